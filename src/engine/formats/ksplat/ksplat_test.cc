#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>

#include "formats/both_ways_for_test.h"
#include "formats/ksplat/ksplat_reader.h"

namespace anchorsplat {
namespace {

template <typename T>
void Put(std::string& bytes, size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}
template <typename T>
void Append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

// One section of three Gaussians with degree 1: buckets of two, the last one partly filled.
std::string Example(uint16_t level) {
  std::string file(4096 + 1024, '\0');
  Put<uint8_t>(file, 1, 1);
  Put<uint32_t>(file, 4, 1);
  Put<uint32_t>(file, 16, 3);
  Put<uint16_t>(file, 20, level);
  Put<float>(file, 36, -2);
  Put<float>(file, 40, 2);
  const size_t section = 4096;
  Put<uint32_t>(file, section, 3);
  Put<uint32_t>(file, section + 4, 3);
  if (level > 0) {
    Put<uint32_t>(file, section + 8, 2);
    Put<uint32_t>(file, section + 12, 2);
    Put<float>(file, section + 16, 4.0f);
    Put<uint16_t>(file, section + 20, 12);
    Put<uint32_t>(file, section + 24, 1000);
    Put<uint32_t>(file, section + 32, 1);
    Put<uint32_t>(file, section + 36, 1);
    Append<uint32_t>(file, 1);
    for (const float x : {1.0f, 2.0f, 3.0f, -1.0f, -2.0f, -3.0f}) Append(file, x);
  }
  Put<uint16_t>(file, section + 40, 1);
  for (int i = 0; i < 3; ++i) {
    if (level == 0) {
      for (const float x : {1.0f * static_cast<float>(i), 2.0f, 3.0f, 1.0f, 0.5f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f}) {
        Append(file, x);
      }
    } else {
      for (const int x : {1000, 1500, 2000, 0x3c00, 0x3800, 0, 0x3c00, 0, 0, 0}) Append(file, static_cast<uint16_t>(x));
    }
    file += std::string("\xff\x80\x00\x80", 4);
    for (int k = 0; k < 9; ++k) {
      if (level == 0) Append(file, static_cast<float>(k));
      if (level == 1) Append(file, static_cast<uint16_t>(k == 4 ? 0xbc00 : 0));
      if (level == 2) Append(file, static_cast<uint8_t>(k == 4 ? 0 : 255));
    }
  }
  return file;
}

Result<GaussianCloud> Read(std::string bytes, const ReadLimits& limits = {}) {
  return ReadBothWays(ReadKsplat, BlocksOfKsplat, InputFile::FromBytes("a.ksplat", std::move(bytes)), limits);
}

TEST(Ksplat, ReadsEveryLevel) {
  for (const uint16_t level : {uint16_t{0}, uint16_t{1}, uint16_t{2}}) {
    const auto cloud = Read(Example(level));
    ASSERT_TRUE(cloud.ok()) << cloud.error().message;
    ASSERT_EQ(cloud->size(), 3);
    ASSERT_EQ(cloud->sh_degree, 1);
    if (level == 0) {
      EXPECT_THAT(cloud->means, testing::ElementsAre(0, 2, 3, 1, 2, 3, 2, 2, 3));
      EXPECT_EQ(cloud->sh[3], 0);  // first coefficient of red, green, blue
      EXPECT_EQ(cloud->sh[4], 3);
      EXPECT_EQ(cloud->sh[5], 6);
      EXPECT_EQ(cloud->sh[9], 2);
    } else {
      EXPECT_THAT(cloud->means, testing::ElementsAre(1, 3, 5, 1, 3, 5, -1, -1, -1));
      EXPECT_EQ(cloud->sh[7], level == 1 ? -1 : -2);  // second coefficient of green
      EXPECT_EQ(cloud->sh[6], level == 1 ? 0 : 2);
    }
    EXPECT_EQ(cloud->log_scales[0], 0);
    EXPECT_NEAR(cloud->log_scales[1], std::log(0.5), 1e-6);
    EXPECT_EQ(cloud->log_scales[2], -INFINITY);
    EXPECT_EQ(cloud->quats[0], 1);
    EXPECT_NEAR(cloud->sh[0], 1.7724539, 1e-5);
    EXPECT_NEAR(1 / (1 + std::exp(-cloud->opacity_logits[0])), 128.0 / 255, 1e-6);
  }
}

// Its viewer turns about this place; the Gaussians are where they are.
TEST(Ksplat, TheSceneCentreMovesNothing) {
  std::string bytes = Example(0);
  Put(bytes, 24, 5.0f);
  EXPECT_THAT(Read(bytes)->means, testing::ElementsAre(0, 2, 3, 1, 2, 3, 2, 2, 3));
  const auto facts = DescribeKsplat(InputFile::FromBytes("a.ksplat", bytes));
  ASSERT_TRUE(facts.ok());
  EXPECT_THAT(facts->all(), testing::Contains(testing::Pair("scene centre", testing::StartsWith("5 0 0"))));
}

TEST(Ksplat, RefusesLies) {
  const auto error_of = [](size_t at, auto value, uint16_t level = 1) {
    std::string bytes = Example(level);
    Put(bytes, at, value);
    const auto cloud = Read(bytes);
    return cloud.ok() ? std::string("accepted") : cloud.error().message;
  };
  const auto expect = [](const std::string& message, const char* part) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  expect(error_of(0, uint8_t{1}), "version 1.1");
  expect(error_of(4, uint32_t{1000}), "1000 sections");
  expect(error_of(16, uint32_t{4}), "sections have 3");
  expect(error_of(16, uint32_t{0}), "no Gaussians");
  expect(error_of(20, uint16_t{3}), "level 3");
  expect(error_of(36, std::nanf("")), "not finite");
  expect(error_of(36, 3.0f), "above the maximum");
  expect(error_of(4096, uint32_t{4}), "section of 4");
  expect(error_of(4096 + 4, uint32_t{0xffffffff}), "would end");
  expect(error_of(4096 + 12, uint32_t{0xffffffff}), "would end");
  expect(error_of(4096 + 32, uint32_t{7}), "bucket sizes are inconsistent");
  expect(error_of(4096 + 40, uint16_t{4}), "SH degree 4");
  expect(error_of(4096 + 36, uint32_t{0}), "in no bucket");
  expect(error_of(4096 + 1024, uint32_t{0}), "accepted");  // the last bucket's size hardly matters
  const std::string good = Example(2);
  for (const size_t size : {size_t{0}, size_t{4095}, size_t{4500}, good.size() - 1}) {
    EXPECT_FALSE(Read(good.substr(0, size)).ok()) << size;
  }
  EXPECT_FALSE(Read(good, {.max_gaussians = 2}).ok());
}

}  // namespace
}  // namespace anchorsplat
