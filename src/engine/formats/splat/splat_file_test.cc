#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <string>

#include "core/random.h"
#include "formats/attribute_error.h"
#include "formats/both_ways_for_test.h"
#include "formats/random_cloud_for_test.h"
#include "formats/splat/splat_reader.h"
#include "formats/splat/splat_writer.h"
#include "formats/splat_order.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

Result<GaussianCloud> Read(const std::filesystem::path& path, const ReadLimits& limits = {}) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const InputFile file, InputFile::Open(path));
  return ReadBothWays(ReadSplat, BlocksOfSplat, file, limits);
}

TEST(SplatFile, BytesOfOneGaussian) {
  const TestFolder folder;
  GaussianCloud cloud;
  cloud.Resize(1, 1);
  cloud.means = {1.5f, -2.0f, 3.25f};
  cloud.log_scales = {0.0f, std::log(2.0f), -std::numeric_limits<float>::infinity()};
  cloud.quats = {0.0f, 2.0f, 0.0f, -2.0f};
  cloud.opacity_logits = {0.0f};
  std::fill(cloud.sh.begin(), cloud.sh.end(), 7.0f);  // beyond degree 0: dropped
  cloud.sh[0] = 0;
  cloud.sh[1] = 1.7724539f;  // white
  cloud.sh[2] = -9;          // clamped
  ASSERT_TRUE(WriteSplat(folder / "a.splat", cloud).ok());
  const auto file = InputFile::Open(folder / "a.splat");
  ASSERT_TRUE(file.ok());
  const std::string bytes = *file->ReadAll(100);
  ASSERT_EQ(bytes.size(), kSplatRecord);
  float numbers[6];
  std::memcpy(numbers, bytes.data(), sizeof numbers);
  EXPECT_THAT(std::vector<float>(numbers, numbers + 6), testing::ElementsAre(1.5f, -2.0f, 3.25f, 1.0f, 2.0f, 0.0f));
  const std::vector<int> expected = {128, 255, 0, 128, 128, 219, 128, 37};
  for (size_t k = 0; k < 8; ++k) EXPECT_EQ(static_cast<uint8_t>(bytes[24 + k]), expected[k]) << k;
}

TEST(SplatFile, RoundTripWithinTheStepsOfTheFormat) {
  const TestFolder folder;
  for (const int64_t n : {1, 255, 30'000}) {
    GaussianCloud cloud = RandomCloud(n, 2, 3);
    ASSERT_TRUE(WriteSplat(folder / "a.splat", cloud, {.overwrite = true}).ok());
    EXPECT_EQ(std::filesystem::file_size(folder / "a.splat"), PredictedSplatSize(n, 2));
    const auto read = Read(folder / "a.splat");
    ASSERT_TRUE(read.ok()) << read.error().message;
    const auto error = CompareAttributes(*read, WithShDegree(cloud, 0), ImportanceOrder(cloud));
    ASSERT_TRUE(error.ok());
    EXPECT_EQ(error->compared, n);
    EXPECT_EQ(error->means.max, 0);
    EXPECT_LT(error->log_scales.max, 2e-6);
    EXPECT_LT(error->rotations.max, 0.03);
    EXPECT_LE(error->opacities.max, 0.5 / 255 + 1e-6);
    EXPECT_GT(error->opacities.max, 0.0);
  }
}

TEST(SplatFile, LargestFirstUnlessTheOrderIsKept) {
  const TestFolder folder;
  GaussianCloud cloud = RandomCloud(1000, 0, 5);
  cloud.opacity_logits[17] = std::nanf("");
  ASSERT_TRUE(WriteSplat(folder / "a.splat", cloud).ok());
  const auto sorted = Read(folder / "a.splat");
  ASSERT_TRUE(sorted.ok());
  const auto importance = [](const GaussianCloud& c, size_t i) {
    return c.log_scales[3 * i] + c.log_scales[3 * i + 1] + c.log_scales[3 * i + 2] -
           std::log1p(std::exp(-c.opacity_logits[i]));
  };
  for (size_t i = 0; i + 2 < 1000; ++i) EXPECT_GT(importance(*sorted, i) + 0.05f, importance(*sorted, i + 1)) << i;
  EXPECT_EQ(sorted->means[3 * 999], cloud.means[3 * 17]);
  ASSERT_TRUE(WriteSplat(folder / "b.splat", cloud, {.order = SplatOrder::kKeep}).ok());
  EXPECT_TRUE(SameBits(Read(folder / "b.splat")->means, cloud.means));
}

TEST(SplatFile, EdgeValuesStayDefined) {
  const TestFolder folder;
  GaussianCloud cloud = RandomCloud(4, 0, 5);
  const float inf = std::numeric_limits<float>::infinity();
  for (float* value : {&cloud.sh[0], &cloud.quats[0], &cloud.opacity_logits[0]}) *value = std::nanf("");
  cloud.sh[3] = inf;
  cloud.opacity_logits[1] = -inf;
  cloud.opacity_logits[2] = inf;
  std::fill_n(&cloud.quats[4], 4, 0.0f);
  ASSERT_TRUE(WriteSplat(folder / "a.splat", cloud, {.order = SplatOrder::kKeep}).ok());
  const auto read = Read(folder / "a.splat");
  ASSERT_TRUE(read.ok());
  EXPECT_NEAR(read->quats[4], 1, 0.01);
  EXPECT_LT(read->opacity_logits[0], -10);
  EXPECT_LT(read->opacity_logits[1], -10);
  EXPECT_GT(read->opacity_logits[2], 10);
  for (int64_t i = 0; i < 4; ++i) EXPECT_TRUE(IsUsable(*read, i));
}

TEST(SplatFile, WhatIsWrittenIsRead) {
  const TestFolder folder;
  GaussianCloud cloud = RandomCloud(100, 0, 5);
  for (float& x : cloud.means) x += 5.4e6f;  // coordinates of the Earth
  ASSERT_TRUE(WriteSplat(folder / "a.splat", cloud, {.order = SplatOrder::kKeep}).ok());
  const auto read = Read(folder / "a.splat");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_TRUE(SameBits(read->means, cloud.means));
  for (float& x : cloud.means) x = 1e20f;
  const Status refused = WriteSplat(folder / "b.splat", cloud);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("100 of 100 Gaussians"), std::string::npos) << refused.error().message;
  EXPECT_FALSE(std::filesystem::exists(folder / "b.splat"));
}

TEST(SplatFile, TextAndOtherFilesAreNone) {
  const auto error_of = [](std::string bytes) {
    const auto cloud = ReadSplat(InputFile::FromBytes("a.splat", std::move(bytes)));
    return cloud.ok() ? std::string("accepted") : cloud.error().message;
  };
  std::string text;
  while (text.size() < 3200) text += "A phone capture becomes a splat, and a splat becomes sharper. ";
  EXPECT_NE(error_of(text.substr(0, 3200)).find("is not a .splat file: "), std::string::npos);
  EXPECT_NE(error_of(std::string(3200, '\xff')).find("100 of 100 rows"), std::string::npos);
  std::string noise(32'000, '\0');
  Random random(7);
  for (char& c : noise) c = static_cast<char>(random.Below(256));
  EXPECT_NE(error_of(noise).find("is not a .splat file"), std::string::npos);
  // Half of the rows may be damaged, no more.
  const TestFolder folder;
  ASSERT_TRUE(WriteSplat(folder / "a.splat", RandomCloud(4, 0, 3)).ok());
  std::string bytes = *InputFile::Open(folder / "a.splat")->ReadAll(1000);
  const float damage[] = {std::nanf(""), 2e12f, -1e-3f};  // a mean, a mean, a scale
  std::memcpy(bytes.data(), &damage[0], 4);
  std::memcpy(bytes.data() + 32 + 8, &damage[1], 4);
  EXPECT_EQ(error_of(bytes), "accepted");
  std::memcpy(bytes.data() + 64 + 20, &damage[2], 4);
  EXPECT_NE(error_of(bytes).find("3 of 4 rows"), std::string::npos);
}

TEST(SplatFile, RefusesWhatIsNone) {
  EXPECT_NE(ReadSplat(InputFile::FromBytes("a.splat", std::string(33, 'x'))).error().message.find("32 bytes"),
            std::string::npos);
  EXPECT_NE(ReadSplat(InputFile::FromBytes("a.splat", "")).error().message.find("is empty, expected 32"),
            std::string::npos);
  EXPECT_EQ(ReadSplat(InputFile::FromBytes("a.splat", std::string(96, 'x')), {.max_gaussians = 2}).error().code,
            ErrorCode::kBadFile);
  const TestFolder folder;
  EXPECT_EQ(WriteSplat(folder / "a.splat", {}).error().code, ErrorCode::kBadArgument);
}

TEST(SplatOrder, MortonPutsNeighboursTogether) {
  GaussianCloud cloud = RandomCloud(20'000, 0, 9);
  cloud.means[3 * 7] = std::nanf("");
  const Buffer<uint32_t> order = MortonOrder(cloud);
  std::vector<bool> seen(20'000);
  for (const uint32_t row : order) seen[row] = true;
  EXPECT_TRUE(std::all_of(seen.begin(), seen.end(), [](bool b) { return b; }));
  EXPECT_EQ(order.back(), 7u);
  const auto distance = [&](uint32_t a, uint32_t b) {
    double sum = 0;
    for (size_t k = 0; k < 3; ++k) sum += std::pow(cloud.means[3 * a + k] - cloud.means[3 * b + k], 2);
    return std::sqrt(sum);
  };
  double sorted = 0, unsorted = 0;
  for (uint32_t i = 8; i + 1 < order.size(); ++i) {
    sorted += i + 2 < order.size() ? distance(order[i], order[i + 1]) : 0;
    unsorted += distance(i, i + 1);
  }
  EXPECT_LT(sorted, unsorted / 10);
  // All in one place: any order, but one.
  std::fill(cloud.means.begin(), cloud.means.end(), 3.0f);
  const Buffer<uint32_t> kept = MortonOrder(cloud);
  for (uint32_t i = 0; i < kept.size(); ++i) ASSERT_EQ(kept[i], i);
}

}  // namespace
}  // namespace anchorsplat
