#include "core/stored_values.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"
#include "core/spherical_harmonics.h"

namespace anchorsplat {
namespace {

// A wall of Gaussians about as long as the way to the next one, in a unit of which there are `units` to a metre; thin
// by `thin` along one axis.
GaussianCloud Wall(int64_t n, double units, double thin, double spread) {
  GaussianCloud cloud;
  cloud.Resize(n, 0);
  Random random(5);
  const double way = std::sqrt(4.0 / static_cast<double>(n));
  for (int64_t i = 0; i < n; ++i) {
    const auto k = static_cast<size_t>(i);
    for (size_t a = 0; a < 3; ++a) {
      const double side = a == 2 ? 0.02 : 2;
      cloud.means[3 * k + a] = static_cast<float>(units * side * (random.Uniform() - 0.5));
      const double length = 2 * way * std::exp(spread * random.Normal()) / (a == 2 ? thin : 1);
      cloud.log_scales[3 * k + a] = static_cast<float>(std::log(units * length));
    }
    for (size_t a = 0; a < 4; ++a) cloud.quats[4 * k + a] = static_cast<float>(random.Normal());
    cloud.opacity_logits[k] = static_cast<float>(2 * random.Normal());
    for (size_t a = 0; a < 3; ++a) cloud.sh[3 * k + a] = DcFromColor(static_cast<float>(random.Uniform()));
  }
  return cloud;
}

TEST(StoredValues, LengthsInAnyUnitAndShape) {
  for (const int64_t n : {400, 5'000, 50'000}) {
    for (const double thin : {1.0, 3.0, 30.0, 1000.0}) {
      for (const double units : {0.01, 1.0, 30.0, 1e3, 1e5}) {
        GaussianCloud cloud = Wall(n, units, thin, 0.5);
        EXPECT_FALSE(LooksLikeLengths(SampleStored(cloud))) << n << " thin " << thin << " units " << units;
        for (float& x : cloud.log_scales) x = std::exp(x);
        // Nearly round ones of about a unit are as likely logarithms.
        if (thin <= 3 && units == 30) continue;
        EXPECT_TRUE(LooksLikeLengths(SampleStored(cloud))) << n << " thin " << thin << " units " << units;
      }
    }
  }
}

TEST(StoredValues, LogarithmsThatLieHigh) {
  // All alike, and none below a unit.
  for (const float scale : {0.0f, 0.3f, 2.0f}) {
    GaussianCloud cloud = Wall(2'000, 100, 1, 0.0);
    for (float& x : cloud.log_scales) x = scale;
    EXPECT_FALSE(LooksLikeLengths(SampleStored(cloud))) << scale;
  }
  GaussianCloud few = Wall(1, 1, 1, 0);
  EXPECT_FALSE(LooksLikeLengths(SampleStored(few)));
  EXPECT_FALSE(LooksLikeLengths(SampleStored(GaussianCloud())));
}

TEST(StoredValues, OpacitiesAndColors) {
  GaussianCloud cloud = Wall(1'000, 1, 3, 0.5);
  EXPECT_FALSE(LooksLikeOpacities(SampleStored(cloud)));
  EXPECT_EQ(LooksLikeColors(SampleStored(cloud)), 0);
  for (float& x : cloud.opacity_logits) x = 1 / (1 + std::exp(-x));
  EXPECT_TRUE(LooksLikeOpacities(SampleStored(cloud)));
  for (float& x : cloud.sh) x = ColorFromDc(x);
  EXPECT_EQ(LooksLikeColors(SampleStored(cloud)), 1);
  for (float& x : cloud.sh) x *= 255;
  EXPECT_EQ(LooksLikeColors(SampleStored(cloud)), 255);
  // Light grey all over.
  for (float& x : cloud.sh) x = 0.2f + 0.5f * x / 255;
  EXPECT_EQ(LooksLikeColors(SampleStored(cloud)), 0);
}

}  // namespace
}  // namespace anchorsplat
