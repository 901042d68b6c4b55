#include "fit/far_units.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fit/cloud_optimizer.h"
#include "fit/densification.h"
#include "fit/mcmc.h"
#include "fit/regularizers.h"
#include "formats/random_cloud_for_test.h"

namespace anchorsplat {
namespace {

constexpr FarUnits kFar = {{0, 0, 0}, 2};

// Random Gaussians of which the first half stands near the middle and the other 20 away from it, ten radii.
GaussianCloud NearAndFar(int64_t n) {
  GaussianCloud cloud = RandomCloud(n, 0, 3);
  for (size_t i = 0; i < static_cast<size_t>(n); ++i) {
    for (size_t k = 0; k < 3; ++k) cloud.means[3 * i + k] = k == 0 && 2 * static_cast<int64_t>(i) >= n ? 20.0f : 0.0f;
    for (size_t k = 0; k < 3; ++k) cloud.log_scales[3 * i + k] = std::log(0.5f);
    cloud.opacity_logits[i] = 2;
  }
  return cloud;
}

CloudGradient SomeGradient(const GaussianCloud& cloud) {
  CloudGradient gradient;
  gradient.means.assign(cloud.means.size(), 0.3f);
  gradient.log_scales.assign(cloud.log_scales.size(), 0.0f);
  gradient.quats.assign(cloud.quats.size(), 0.0f);
  gradient.opacity_logits.assign(cloud.opacity_logits.size(), 0.0f);
  gradient.sh.assign(cloud.sh.size(), 0.0f);
  gradient.means2d.assign(2 * cloud.opacity_logits.size(), 0.0f);
  gradient.radii.assign(2 * cloud.opacity_logits.size(), 3);
  return gradient;
}

TEST(FarUnitsInAFit, MeansMoveAsMuchFarther) {
  const GaussianCloud start = NearAndFar(8);
  const auto step = [&](const FarUnits& far) {
    GaussianCloud cloud = start;
    CloudOptimizer optimizer(cloud);
    optimizer.FinishStep({}, 0.01, SomeGradient(cloud), cloud, far);
    return cloud;
  };
  const GaussianCloud plain = step({}), far = step(kFar);
  for (size_t i = 0; i < 24; ++i) {
    if (i < 12) {
      EXPECT_EQ(far.means[i], plain.means[i]) << "the middle is as it was, to the bit";
    } else {
      EXPECT_NEAR(far.means[i] - start.means[i], 10 * (plain.means[i] - start.means[i]), 1e-5);
    }
  }
  EXPECT_EQ(far.quats, plain.quats);
}

TEST(FarUnitsInAFit, SizesAreMeasuredInThem) {
  // 0.5 is five times the size that goes in the middle, and half of what goes ten times as far away.
  DensificationOptions options;
  options.reset_every = 1;
  options.refine_start_iter = 0;
  options.refine_every = 1;
  const auto left = [&](const FarUnits& far) {
    GaussianCloud cloud = NearAndFar(8);
    Densification densification(8);
    const auto change = densification.AfterStep(options, 2, 1, 0, 100, 100, SomeGradient(cloud), cloud, far);
    EXPECT_EQ(change.pruned, 8 - cloud.size());
    return cloud;
  };
  EXPECT_EQ(left({}).size(), 0);
  const GaussianCloud kept = left(kFar);
  ASSERT_EQ(kept.size(), 4);
  for (int64_t i = 0; i < 4; ++i) EXPECT_EQ(kept.means[static_cast<size_t>(3 * i)], 20);
}

TEST(FarUnitsInAFit, RegularizerAndNoiseAreWeaker) {
  GaussianCloud cloud = NearAndFar(8);
  CloudGradient gradient = SomeGradient(cloud);
  AddRegularizers({.scale_reg = 1}, 1, kFar, cloud, gradient);
  EXPECT_GT(gradient.log_scales[0], 0);
  EXPECT_FLOAT_EQ(gradient.log_scales[12], gradient.log_scales[0] / 10);

  std::fill(cloud.opacity_logits.begin(), cloud.opacity_logits.end(), -9.0f);
  GaussianCloud plain = cloud, far = cloud;
  const McmcOptions options;
  McmcStep step{.step = 0, .means_rate = 1e-7};
  McmcAfterStep(options, step, plain);
  step.far = kFar;
  McmcAfterStep(options, step, far);
  for (size_t i = 0; i < 24; ++i) {
    const double there = plain.means[i] - cloud.means[i], here = far.means[i] - cloud.means[i];
    EXPECT_NE(there, 0);
    if (i < 12) {
      EXPECT_EQ(here, there);
    } else {
      EXPECT_NEAR(here, there / 10, 1e-5);
    }
  }
}

TEST(FarUnitsInAFit, GrowWithTheDistance) {
  const FarUnits units = {{1, 0, 0}, 2};
  const auto at = [&](float x, float y, float z) {
    const float p[] = {x, y, z};
    return units.FactorAt(p);
  };
  EXPECT_EQ(at(1, 0, 0), 1);
  EXPECT_EQ(at(1, 1.9f, 0), 1);
  EXPECT_DOUBLE_EQ(at(1, 0, 8), 4);
  EXPECT_DOUBLE_EQ(at(-5, 0, 0), 3);
  EXPECT_EQ(at(NAN, 0, 0), 1);
  EXPECT_EQ(at(INFINITY, 0, 0), 1);
  const float far[] = {100, 0, 0};
  EXPECT_EQ(FarUnits().FactorAt(far), 1);
}

}  // namespace
}  // namespace anchorsplat
