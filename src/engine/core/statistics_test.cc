#include "core/statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/random.h"

namespace anchorsplat {
namespace {

// A healthy cloud in the unit cube: lengths of about e^-4, opacity about one half, unit quaternions.
GaussianCloud HealthyCloud(int64_t n) {
  GaussianCloud cloud;
  cloud.Resize(n, 0);
  Random random(5);
  for (float& x : cloud.means) x = static_cast<float>(random.Uniform(-0.5, 0.5));
  for (float& x : cloud.log_scales) x = static_cast<float>(-4 + 0.5 * random.Normal());
  for (size_t i = 0; i < cloud.quats.size(); ++i) cloud.quats[i] = i % 4 == 0 ? 1.0f : 0.0f;
  for (float& x : cloud.opacity_logits) x = static_cast<float>(2 * random.Normal());
  for (float& x : cloud.sh) x = 0;
  return cloud;
}

TEST(Quantile, InterpolatesBetweenNeighbours) {
  std::vector<float> values = {4, 1, 3, 2};
  EXPECT_FLOAT_EQ(Quantile(values, 0), 1);
  EXPECT_FLOAT_EQ(Quantile(values, 0.5), 2.5f);
  EXPECT_FLOAT_EQ(Quantile(values, 1), 4);
  EXPECT_FLOAT_EQ(Quantile(values, 0.1), 1.3f);
  EXPECT_TRUE(std::isnan(Quantile({}, 0.5)));
  const float inf = std::numeric_limits<float>::infinity();
  std::vector<float> endless = {inf, 1, inf};
  EXPECT_EQ(Quantile(endless, 0.75), inf);  // not inf − inf
}

TEST(Statistics, HealthyCloudHasNoProblems) {
  const CloudStatistics s = ComputeStatistics(HealthyCloud(2000));
  EXPECT_EQ(s.gaussians, 2000);
  EXPECT_EQ(s.not_finite + s.zero_quaternions + s.unnormalised_quaternions + s.zero_scales + s.outliers, 0);
  EXPECT_FALSE(s.linear_looking_scales);
  EXPECT_FALSE(s.linear_looking_opacities);
  EXPECT_NEAR(s.opacity[2], 0.5, 0.05);
  EXPECT_NEAR(std::log(s.largest_axis[2]), -4 + 0.5 * 0.8463, 0.05);  // median of the largest of three normals
  EXPECT_GE(s.axis_ratio[0], 1);
}

TEST(Statistics, FlatGaussiansHaveAnExtent) {
  GaussianCloud cloud = HealthyCloud(500);
  const CloudStatistics healthy = ComputeStatistics(cloud);
  for (size_t i = 0; i < 500; ++i) cloud.log_scales[3 * i] = -std::numeric_limits<float>::infinity();
  const CloudStatistics s = ComputeStatistics(cloud);
  EXPECT_EQ(s.not_finite, 0);
  EXPECT_EQ(s.zero_scales, 500);
  EXPECT_GT(s.largest_axis[2], 0.3f * healthy.largest_axis[2]);
  EXPECT_EQ(s.smallest_axis[2], 0);
}

TEST(Statistics, CountsHarmonicsOnlyWhereAsked) {
  GaussianCloud cloud = HealthyCloud(10);
  cloud.sh[0] = std::nanf("");
  EXPECT_EQ(CountUnusable(cloud), 1);
  EXPECT_EQ(CountUnusable(cloud, false), 0);
}

TEST(Statistics, CountsEachProblemOnce) {
  GaussianCloud cloud = HealthyCloud(1000);
  cloud.means[0] = std::nanf("");                                     // row 0
  for (size_t k = 0; k < 4; ++k) cloud.quats[4 + k] = 0;              // row 1
  cloud.quats[8] = 2;                                                 // row 2
  std::fill_n(cloud.quats.data() + 24, 4, 1e-30f);                    // row 6: short, but a rotation
  cloud.log_scales[9] = -std::numeric_limits<float>::infinity();      // row 3
  cloud.means[12] = 1000;                                             // row 4
  cloud.opacity_logits[5] = -std::numeric_limits<float>::infinity();  // row 5
  const int64_t invisible_before = ComputeStatistics(HealthyCloud(1000)).invisible;
  const CloudStatistics s = ComputeStatistics(cloud);
  EXPECT_EQ(s.not_finite, 1);
  EXPECT_EQ(s.zero_quaternions, 1);
  EXPECT_EQ(s.unnormalised_quaternions, 2);
  EXPECT_EQ(s.zero_scales, 1);
  EXPECT_EQ(s.outliers, 1);
  EXPECT_EQ(s.invisible, invisible_before + 1);
  EXPECT_EQ(CountUnusable(cloud), 1);
  EXPECT_EQ(s.implausible, 0);
  cloud.means[16] = -2e6f;
  cloud.log_scales[20] = 14;  // 1.2 million
  cloud.log_scales[26] = 13.8f;
  EXPECT_EQ(ComputeStatistics(cloud).implausible, 2);
}

TEST(Statistics, RecognisesLinearScalesAndOpacities) {
  GaussianCloud cloud = HealthyCloud(500);
  for (float& x : cloud.log_scales) x = std::exp(x);
  for (float& x : cloud.opacity_logits) x = 1 / (1 + std::exp(-x));
  const CloudStatistics s = ComputeStatistics(cloud);
  EXPECT_TRUE(s.linear_looking_scales);
  EXPECT_TRUE(s.linear_looking_opacities);
}

TEST(Statistics, EmptyCloudIsNotAnError) {
  const CloudStatistics s = ComputeStatistics(GaussianCloud{});
  EXPECT_EQ(s.gaussians, 0);
  EXPECT_FALSE(s.bounds.has_value());
  EXPECT_TRUE(std::isnan(s.opacity[2]));
}

}  // namespace
}  // namespace anchorsplat
