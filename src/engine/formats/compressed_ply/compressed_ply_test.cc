#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "formats/attribute_error.h"
#include "formats/both_ways_for_test.h"
#include "formats/compressed_ply/compressed_ply_reader.h"
#include "formats/compressed_ply/compressed_ply_writer.h"
#include "formats/random_cloud_for_test.h"
#include "formats/splat_order.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

Result<GaussianCloud> Read(const std::filesystem::path& path, const ReadLimits& limits = {}) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const InputFile file, InputFile::Open(path));
  return ReadBothWays(ReadCompressedPly, BlocksOfCompressedPly, file, limits);
}

std::string ErrorOf(std::string bytes) {
  const auto cloud = ReadBothWays(ReadCompressedPly, BlocksOfCompressedPly,
                                  InputFile::FromBytes("a.compressed.ply", std::move(bytes)));
  return cloud.ok() ? "accepted" : cloud.error().message;
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(CompressedPly, RoundTripWithinTheStepsOfTheFormat) {
  const TestFolder folder;
  for (int degree = 0; degree <= kMaxShDegree; ++degree) {
    for (const int64_t n : {1, 256, 257, 20'000}) {
      GaussianCloud cloud = RandomCloud(n, degree, static_cast<uint64_t>(n + degree));
      for (float& x : cloud.sh) x = std::clamp(x, -4.0f, 4.0f);
      ASSERT_TRUE(WriteCompressedPly(folder / "a.ply", cloud, {.overwrite = true}).ok());
      EXPECT_EQ(std::filesystem::file_size(folder / "a.ply"), PredictedCompressedPlySize(n, degree));
      const auto read = Read(folder / "a.ply");
      ASSERT_TRUE(read.ok()) << read.error().message;
      ASSERT_EQ(read->sh_degree, degree);
      const auto error = CompareAttributes(*read, cloud, MortonOrder(cloud));
      ASSERT_TRUE(error.ok());
      EXPECT_EQ(error->compared, n);
      EXPECT_LT(error->means.max, 10.0 / 2046);  // half a step of the widest possible range
      EXPECT_LT(error->log_scales.max, 10.0 / 2046);
      EXPECT_LT(error->rotations.max, 0.01);
      EXPECT_LT(error->opacities.max, 0.5 / 255 + 1e-6);
      EXPECT_LT(error->colors.max, 0.5 * 10 * 0.282 / 255);
      EXPECT_LE(error->harmonics.max, 1.0 / 32 + 1e-6);  // a whole step at the two ends
      EXPECT_NEAR(error->harmonics.rms, degree > 0 ? 1.0 / 32 / std::sqrt(12.0) : 0.0, 0.006);
    }
  }
}

TEST(CompressedPly, KeepsOrderAndMetadataWhenAsked) {
  const TestFolder folder;
  GaussianCloud cloud = RandomCloud(3000, 1, 4);
  cloud.comments = {"made by a test", "line\nend"};
  cloud.render_mode = RenderMode::kMip;
  ASSERT_TRUE(WriteCompressedPly(folder / "a.ply", cloud, {.order = SplatOrder::kKeep}).ok());
  const auto read = Read(folder / "a.ply");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_THAT(read->comments, testing::ElementsAre("made by a test", "line end"));
  EXPECT_EQ(read->render_mode, RenderMode::kMip);
  EXPECT_LT(CompareAttributes(*read, cloud)->means.max, 10.0 / 2046);
}

TEST(CompressedPly, WritingWhatWasReadChangesNothing) {
  const TestFolder folder;
  ASSERT_TRUE(WriteCompressedPly(folder / "a.ply", RandomCloud(700, 3, 4)).ok());
  const auto once = Read(folder / "a.ply");
  ASSERT_TRUE(once.ok());
  ASSERT_TRUE(WriteCompressedPly(folder / "b.ply", *once, {.order = SplatOrder::kKeep}).ok());
  const auto twice = Read(folder / "b.ply");
  ASSERT_TRUE(twice.ok());
  const auto error = CompareAttributes(*once, *twice);
  EXPECT_LT(error->means.max, 1e-6);
  EXPECT_LT(error->log_scales.max, 1e-6);
  EXPECT_LT(error->colors.max, 1e-6);
  EXPECT_EQ(error->harmonics.max, 0);
  EXPECT_EQ(error->opacities.max, 0);
}

TEST(CompressedPly, EdgeValuesStayDefinedAndAlone) {
  const TestFolder folder;
  GaussianCloud cloud = RandomCloud(256, 1, 4);
  const float inf = std::numeric_limits<float>::infinity();
  cloud.means[0] = std::nanf("");
  cloud.means[3] = inf;
  cloud.log_scales[6] = -inf;
  cloud.quats[12] = std::nanf("");
  std::fill_n(&cloud.quats[16], 4, 0.0f);
  cloud.sh[12 * 5] = std::nanf("");
  cloud.sh[12 * 6 + 5] = inf;
  cloud.opacity_logits[7] = std::nanf("");
  ASSERT_TRUE(WriteCompressedPly(folder / "a.ply", cloud, {.order = SplatOrder::kKeep}).ok());
  const auto read = Read(folder / "a.ply");
  ASSERT_TRUE(read.ok());
  for (int64_t i = 0; i < 256; ++i) EXPECT_TRUE(IsUsable(*read, i)) << i;
  EXPECT_NEAR(read->log_scales[6], -20, 1e-5);
  EXPECT_NEAR(read->quats[16], 1, 0.01);  // the zero quaternion is no rotation
  EXPECT_EQ(read->sh[12 * 6 + 5], 4);
  const auto error = CompareAttributes(*read, cloud);
  EXPECT_EQ(error->left_out, 6);
  EXPECT_LT(error->means.max, 10.0 / 2046);
}

TEST(CompressedPly, ReadsFilesWithoutColourRanges) {
  const TestFolder folder;
  // One chunk, one Gaussian: everything at the upper end, opacity 128/255.
  std::string file = "ply\nformat binary_little_endian 1.0\nelement chunk 1\n";
  for (const char* name : {"min_x", "min_y", "min_z", "max_x", "max_y", "max_z", "min_scale_x", "min_scale_y",
                           "min_scale_z", "max_scale_x", "max_scale_y", "max_scale_z"}) {
    file += std::string("property float ") + name + "\n";
  }
  file += "element vertex 1\n";
  for (const char* name : {"position", "rotation", "scale", "color"}) {
    file += std::string("property uint packed_") + name + "\n";
  }
  file += "end_header\n";
  const float ranges[12] = {0, 0, 0, 1, 2, 3, -5, -5, -5, -1, -2, -3};
  file.append(reinterpret_cast<const char*>(ranges), sizeof ranges);
  const uint32_t packed[4] = {0xffffffffu, 2u << 30 | 512u << 20 | 512u << 10 | 512u, 0xffffffffu, 0xff00ff80u};
  file.append(reinterpret_cast<const char*>(packed), sizeof packed);
  const auto cloud = ReadCompressedPly(InputFile::FromBytes("a.compressed.ply", file));
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  EXPECT_THAT(cloud->means, testing::ElementsAre(1.0f, 2.0f, 3.0f));
  EXPECT_THAT(cloud->log_scales, testing::ElementsAre(-1.0f, -2.0f, -3.0f));
  EXPECT_NEAR(cloud->quats[2], 1, 1e-5);
  EXPECT_NEAR(cloud->sh[0], 1.7724539, 1e-5);
  EXPECT_NEAR(cloud->sh[1], -1.7724539, 1e-5);
  EXPECT_NEAR(1 / (1 + std::exp(-cloud->opacity_logits[0])), 128.0 / 255, 1e-6);
}

TEST(CompressedPly, RefusesWhatDoesNotBelongTogether) {
  const TestFolder folder;
  ASSERT_TRUE(WriteCompressedPly(folder / "a.ply", RandomCloud(300, 1, 4)).ok());
  const std::string good = FileBytes(folder / "a.ply");
  EXPECT_EQ(ErrorOf(good), "accepted");
  const auto expect = [](const std::string& message, const std::string& part) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  expect(ErrorOf(Replaced(good, "chunk 2", "chunk 1")), "1 chunks for 300");
  expect(ErrorOf(Replaced(good, "element sh 300", "element sh 299")), "299 rows");
  expect(ErrorOf(Replaced(good, "property float min_y", "property float min_w")), "\"min_y\"");
  expect(ErrorOf(Replaced(good, "property float max_b", "property float max_k")), "\"max_b\"");
  expect(ErrorOf(Replaced(good, "uint packed_scale", "int packed_scale")), "\"packed_scale\" of type uint");
  expect(ErrorOf(Replaced(good, "uchar f_rest_3", "uchar f_rest_9")), "\"f_rest_3\"");
  expect(ErrorOf(Replaced(good, "uchar f_rest_3", "uchar f_west_3")), "8 properties");
  expect(ErrorOf(Replaced(good, "element vertex 300", "element vertex 999999999999")), "ends too early");
  expect(ErrorOf(Replaced(good, "little_endian", "big_endian")), "little-endian");
  expect(ErrorOf(Replaced(good, "property uint packed_scale", "property list uchar uint packed_scale")), "lists");
  expect(ErrorOf(good.substr(0, good.size() - 1)), "ends too early");
  std::string upside_down = good;
  const float high = 1e9f;
  // min_y of the second chunk, whose ranges are 18 floats.
  std::memcpy(upside_down.data() + upside_down.find("end_header\n") + 11 + 18 * 4 + 4, &high, sizeof high);
  expect(ErrorOf(upside_down), "chunk 1 has min_y 1e+09");
  EXPECT_EQ(Read(folder / "a.ply", {.max_gaussians = 299}).error().code, ErrorCode::kBadFile);
}

}  // namespace
}  // namespace anchorsplat
