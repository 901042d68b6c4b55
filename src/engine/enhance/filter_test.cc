#include "enhance/filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"
#include "core/rotation.h"

namespace anchorsplat {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

GaussianCloud RandomCloud(int64_t n, uint64_t seed) {
  GaussianCloud cloud;
  cloud.Resize(n, 1);
  Random random(seed);
  for (float& x : cloud.means) x = static_cast<float>(random.Normal());
  for (float& x : cloud.log_scales) x = static_cast<float>(-5 + 2 * random.Normal());
  for (float& x : cloud.quats) x = static_cast<float>(random.Normal());
  for (float& x : cloud.opacity_logits) x = static_cast<float>(random.Normal());
  for (float& x : cloud.sh) x = static_cast<float>(random.Normal());
  return cloud;
}

// Σ = R diag(exp(2 s)) Rᵀ in double.
std::array<double, 9> Covariance(const GaussianCloud& cloud, size_t i) {
  const auto r = RotationFromQuaternion<double>(cloud.quats[4 * i], cloud.quats[4 * i + 1], cloud.quats[4 * i + 2],
                                                cloud.quats[4 * i + 3]);
  std::array<double, 9> sigma{};
  for (size_t a = 0; a < 3; ++a) {
    for (size_t b = 0; b < 3; ++b) {
      for (size_t k = 0; k < 3; ++k) {
        sigma[3 * a + b] += r[3 * a + k] * r[3 * b + k] * std::exp(2.0 * cloud.log_scales[3 * i + k]);
      }
    }
  }
  return sigma;
}

TEST(Filter, DefaultStrengthTakesOneBoxOutAndPutsTheOtherBack) {
  EXPECT_NEAR(DefaultFilterStrength(4), 0.7396, 1e-4);
  EXPECT_NEAR(DefaultFilterStrength(2), 0.7917, 1e-4);
  EXPECT_DOUBLE_EQ(DefaultFilterStrength(1), 1);
  // The same thing said with variances: 0.3 − 1/12 + 1/(12 u²), in low-resolution pixels.
  for (const double u : {1.0, 1.5, 3.0, 8.0}) {
    EXPECT_NEAR(0.3 * DefaultFilterStrength(u), 0.3 - 1.0 / 12 + 1 / (12 * u * u), 1e-12);
  }
}

TEST(Filter, AddsTheFormulaToEveryCovariance) {
  const GaussianCloud before = RandomCloud(50, 1);
  for (const bool per_gaussian : {false, true}) {
    std::vector<float> pixels(per_gaussian ? 50 : 1);
    Random random(2);
    for (float& p : pixels) p = static_cast<float>(random.Uniform(0.001, 0.1));
    GaussianCloud after = before;
    const auto grown = ApplyFilter(after, pixels, {.upscale = 3, .strength = 0.6});
    ASSERT_TRUE(grown.ok());
    EXPECT_EQ(*grown, 50);
    for (size_t i = 0; i < 50; ++i) {
      const double p = pixels[per_gaussian ? i : 0];
      const double added = 0.6 * 0.3 * p * p - 0.3 * (p / 3) * (p / 3);
      const auto a = Covariance(before, i), b = Covariance(after, i);
      for (size_t k = 0; k < 9; ++k) {
        const double expected = a[k] + (k % 4 == 0 ? added : 0);
        EXPECT_NEAR(b[k], expected, 2e-6 * (a[0] + a[4] + a[8] + added)) << i << " " << k;
      }
    }
    EXPECT_EQ(after.quats, before.quats);
    EXPECT_EQ(after.opacity_logits, before.opacity_logits);
    EXPECT_EQ(after.means, before.means);
    EXPECT_EQ(after.sh, before.sh);
  }
}

// The closer view widens by 0.1 px² of its own in that mode, so that is what is taken off.
TEST(Filter, TakesOffTheDilationOfTheMode) {
  GaussianCloud before = RandomCloud(20, 4);
  before.render_mode = RenderMode::kMip;
  GaussianCloud after = before;
  ASSERT_TRUE(ApplyFilter(after, std::vector<float>{0.05f}, {.upscale = 2, .strength = 0.4}).ok());
  const double added = 0.4 * 0.3 * 0.0025 - 0.1 * 0.0025 / 4;
  for (size_t i = 0; i < 20; ++i) {
    const auto a = Covariance(before, i), b = Covariance(after, i);
    for (size_t k = 0; k < 9; k += 4) EXPECT_NEAR(b[k], a[k] + added, 1e-5 * (a[k] + added));
  }
}

TEST(Filter, ChangesNothingWhereThereIsNothingToGive) {
  const GaussianCloud before = RandomCloud(10, 3);
  for (const FilterOptions options :
       {FilterOptions{.upscale = 1, .strength = {}}, FilterOptions{.upscale = 4, .strength = 0.0},
        FilterOptions{.upscale = 2, .strength = 0.25}}) {
    GaussianCloud after = before;
    const auto grown = ApplyFilter(after, std::vector<float>{0.01f}, options);
    ASSERT_TRUE(grown.ok());
    EXPECT_EQ(*grown, 0);
    EXPECT_EQ(after.log_scales, before.log_scales);
  }
}

TEST(Filter, ZeroHugeTinyAndBrokenRows) {
  GaussianCloud cloud = RandomCloud(5, 4);
  cloud.log_scales = {-kInfinity,
                      -kInfinity,
                      -kInfinity,  // scale 0
                      40,
                      -80,
                      0,  // huge and tiny in one needle
                      std::nanf(""),
                      0,
                      0,  // broken
                      -3,
                      -3,
                      -3,  // broken mean
                      kMaxLogScale,
                      -3e38f,
                      0};  // at the ends of what is drawn
  cloud.means[9] = kInfinity;
  const auto grown = ApplyFilter(cloud, std::vector<float>{0.1f}, {.upscale = 4, .strength = {}});
  ASSERT_TRUE(grown.ok());
  EXPECT_EQ(*grown, 3);
  const double added = 0.3 * 0.01 * (DefaultFilterStrength(4) - 1.0 / 16);
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(cloud.log_scales[k], 0.5 * std::log(added), 1e-6);
  EXPECT_EQ(cloud.log_scales[3], 40);
  EXPECT_NEAR(cloud.log_scales[4], 0.5 * std::log(added), 1e-6);
  EXPECT_TRUE(std::isnan(cloud.log_scales[6]));
  EXPECT_EQ(cloud.log_scales[9], -3);
  EXPECT_EQ(cloud.log_scales[12], kMaxLogScale);
  EXPECT_TRUE(std::isfinite(cloud.log_scales[13]));
}

TEST(Filter, RefusesWhatMakesNoSense) {
  GaussianCloud cloud = RandomCloud(3, 5);
  const std::vector<float> one = {0.1f};
  for (const double upscale : {0.5, 0.0, -1.0, std::nan(""), double{kInfinity}}) {
    EXPECT_FALSE(ApplyFilter(cloud, one, {.upscale = upscale, .strength = {}}).ok()) << upscale;
  }
  for (const double strength : {-0.1, std::nan(""), double{kInfinity}}) {
    EXPECT_FALSE(ApplyFilter(cloud, one, {.upscale = 4, .strength = strength}).ok()) << strength;
  }
  for (const std::vector<float>& pixels :
       {std::vector<float>{}, {0.1f, 0.1f}, {0.0f}, {-1.0f}, {std::nanf("")}, {kInfinity}}) {
    EXPECT_FALSE(ApplyFilter(cloud, pixels, {}).ok());
  }
  GaussianCloud empty;
  EXPECT_TRUE(ApplyFilter(empty, one, {}).ok());
}

TEST(Filter, SameBitsForAnyNumberOfThreads) {
  GaussianCloud one = RandomCloud(70000, 6), five = one;
  const std::vector<float> pixels = {0.02f};
  SetThreadCount(1);
  ASSERT_TRUE(ApplyFilter(one, pixels, {}).ok());
  SetThreadCount(5);
  ASSERT_TRUE(ApplyFilter(five, pixels, {}).ok());
  SetThreadCount(0);
  EXPECT_EQ(one.log_scales, five.log_scales);
}

}  // namespace
}  // namespace anchorsplat
