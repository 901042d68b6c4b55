#include "core/gaussian_cloud.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/most_visible.h"
#include "core/random.h"

namespace anchorsplat {
namespace {

GaussianCloud RandomCloud(int64_t n, int degree, uint64_t seed) {
  GaussianCloud cloud;
  cloud.Resize(n, degree);
  Random random(seed);
  for (Buffer<float>* array : {&cloud.means, &cloud.log_scales, &cloud.quats, &cloud.opacity_logits, &cloud.sh}) {
    for (float& x : *array) x = static_cast<float>(random.Normal());
  }
  return cloud;
}

TEST(GaussianCloud, ResizeKeepsTheArraysInStep) {
  for (int degree = 0; degree <= kMaxShDegree; ++degree) {
    const GaussianCloud cloud = RandomCloud(7, degree, 1);
    EXPECT_TRUE(Validate(cloud).ok());
    EXPECT_EQ(cloud.size(), 7);
    EXPECT_EQ(cloud.bytes(), 7 * 4 * (11 + 3 * (degree + 1) * (degree + 1)));
  }
}

TEST(GaussianCloud, ValidateNamesTheArrayThatIsOff) {
  GaussianCloud cloud = RandomCloud(3, 1, 2);
  cloud.quats.pop_back();
  const Status status = Validate(cloud);
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("quats has 11 values, expected 3 x 4"), std::string::npos)
      << status.error().message;
  cloud = RandomCloud(3, 1, 2);
  cloud.sh_degree = 4;
  EXPECT_FALSE(Validate(cloud).ok());
}

TEST(GaussianCloud, BoundsSkipWhatIsNotFinite) {
  GaussianCloud cloud = RandomCloud(3, 0, 3);
  cloud.means = {1, 2, 3, -4, 5, -6, std::nanf(""), 100, 100};
  const auto box = ComputeBounds(cloud);
  ASSERT_TRUE(box.has_value());
  EXPECT_EQ(box->min, (std::array<float, 3>{-4, 2, -6}));
  EXPECT_EQ(box->max, (std::array<float, 3>{1, 5, 3}));
  cloud.means.assign(9, std::nanf(""));
  EXPECT_FALSE(ComputeBounds(cloud).has_value());
  EXPECT_FALSE(ComputeBounds(GaussianCloud{}).has_value());
}

TEST(GaussianCloud, SubsetKeepsOrderAndAllowsRepetition) {
  GaussianCloud cloud = RandomCloud(5, 2, 4);
  cloud.render_mode = RenderMode::kAntialiased;
  const std::vector<int64_t> rows = {4, 0, 4};
  const auto subset = Subset(cloud, rows);
  ASSERT_TRUE(subset.ok());
  ASSERT_EQ(subset->size(), 3);
  EXPECT_EQ(subset->render_mode, RenderMode::kAntialiased);
  for (size_t k = 0; k < rows.size(); ++k) {
    const auto row = static_cast<size_t>(rows[k]);
    EXPECT_EQ(subset->opacity_logits[k], cloud.opacity_logits[row]);
    for (size_t j = 0; j < 27; ++j) EXPECT_EQ(subset->sh[27 * k + j], cloud.sh[27 * row + j]);
    for (size_t j = 0; j < 4; ++j) EXPECT_EQ(subset->quats[4 * k + j], cloud.quats[4 * row + j]);
  }
  EXPECT_FALSE(Subset(cloud, std::vector<int64_t>{5}).ok());
  EXPECT_FALSE(Subset(cloud, std::vector<int64_t>{-1}).ok());
}

TEST(GaussianCloud, AppendRaisesTheLowerDegree) {
  const GaussianCloud low = RandomCloud(2, 0, 5), high = RandomCloud(3, 3, 6);
  GaussianCloud joined = low;
  ASSERT_TRUE(Append(joined, high).ok());
  ASSERT_EQ(joined.size(), 5);
  EXPECT_EQ(joined.sh_degree, 3);
  EXPECT_TRUE(Validate(joined).ok());
  EXPECT_EQ(joined.sh[0], low.sh[0]);
  EXPECT_EQ(joined.sh[3], 0.0f);
  EXPECT_EQ(joined.sh[48 * 2 + 47], high.sh[47]);
  joined = high;
  ASSERT_TRUE(Append(joined, low).ok());
  EXPECT_EQ(joined.sh_degree, 3);
  EXPECT_EQ(joined.sh[48 * 3], low.sh[0]);
  EXPECT_EQ(joined.sh[48 * 3 + 5], 0.0f);
}

TEST(GaussianCloud, InfinityIsLegalOnlyWhereItMeansZeroOrOne) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const GaussianCloud good = RandomCloud(1, 1, 7);
  GaussianCloud cloud = good;
  EXPECT_TRUE(IsUsable(cloud, 0));
  cloud.log_scales[1] = -kInfinity;
  cloud.opacity_logits[0] = -kInfinity;
  EXPECT_TRUE(IsUsable(cloud, 0));
  cloud.opacity_logits[0] = kInfinity;
  EXPECT_TRUE(IsUsable(cloud, 0));
  cloud.log_scales[1] = kInfinity;
  EXPECT_FALSE(IsUsable(cloud, 0));
  for (Buffer<float> GaussianCloud::*array : {&GaussianCloud::means, &GaussianCloud::log_scales, &GaussianCloud::quats,
                                              &GaussianCloud::opacity_logits, &GaussianCloud::sh}) {
    cloud = good;
    (cloud.*array).back() = std::nanf("");
    EXPECT_FALSE(IsUsable(cloud, 0));
  }
}

TEST(GaussianCloud, IsDrawnWhereSizeAndOpacityAllow) {
  GaussianCloud cloud = RandomCloud(1, 0, 7);
  cloud.opacity_logits = {0};
  for (const float scale : {40.0f, 44.0f, 44.1f, 60.0f, 88.0f, 128.0f}) {
    for (size_t a = 0; a < 3; ++a) {
      GaussianCloud large = cloud;
      large.log_scales[a] = scale;
      EXPECT_EQ(IsUsable(large, 0), scale <= 44) << scale;
      EXPECT_EQ(IsDrawn(large, 0), scale <= 44) << scale;
      EXPECT_EQ(IsFinite(large, 0), scale <= 44) << scale;
      EXPECT_EQ(ComputeBounds(large).has_value(), scale <= 44) << scale;
    }
  }
  for (const float logit : {-5.6f, -100.0f, -std::numeric_limits<float>::infinity()}) {
    cloud.opacity_logits = {logit};
    EXPECT_TRUE(IsUsable(cloud, 0));
    EXPECT_FALSE(IsDrawn(cloud, 0));
  }
  cloud.opacity_logits = {-5.5f};
  EXPECT_TRUE(IsDrawn(cloud, 0));
}

TEST(MostVisible, WhatNobodyDrawsComesLast) {
  GaussianCloud cloud = RandomCloud(8, 0, 9);
  for (float& x : cloud.opacity_logits) x = 1;
  cloud.log_scales[0] = std::numeric_limits<float>::infinity();
  cloud.log_scales[4] = 95;
  for (size_t k = 6; k < 9; ++k) cloud.log_scales[k] = 30;
  cloud.opacity_logits[2] = -6;  // enormous, and too faint to be drawn
  cloud.sh[9] = std::nanf("");
  for (size_t k = 12; k < 15; ++k) cloud.log_scales[k] = -std::numeric_limits<float>::infinity();  // a point, drawn
  EXPECT_EQ(MostVisible(cloud, 4), (std::vector<int64_t>{4, 5, 6, 7}));
  EXPECT_EQ(MostVisible(cloud, 5).front(), 0);
}

}  // namespace
}  // namespace anchorsplat
