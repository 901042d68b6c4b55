#include "core/framing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/random.h"

namespace anchorsplat {
namespace {

TEST(Framing, IgnoresOutliersAndHaze) {
  GaussianCloud cloud;
  cloud.Resize(1000, 0);
  Random random(3);
  for (size_t i = 0; i < 1000; ++i) {
    for (size_t a = 0; a < 3; ++a) cloud.means[3 * i + a] = static_cast<float>(10 + random.Uniform(-1, 1));
    cloud.opacity_logits[i] = 1;
  }
  cloud.means[0] = 1e6f;                 // an outlier
  cloud.means[4] = std::nanf("");        // a broken row
  for (size_t i = 900; i < 1000; ++i) {  // haze far away
    cloud.means[3 * i] = 500;
    cloud.opacity_logits[i] = -5;
  }
  const Framing framing = FrameCloud(cloud);
  for (const double c : framing.target) EXPECT_NEAR(c, 10, 0.1);
  EXPECT_GT(framing.radius, 1);
  EXPECT_LT(framing.radius, std::sqrt(3.0) + 0.1);
}

TEST(Framing, AlwaysHasARadius) {
  EXPECT_EQ(FrameCloud(GaussianCloud{}).radius, 1);
  GaussianCloud one;
  one.Resize(1, 0);
  one.means = {3, 4, 5};
  one.opacity_logits = {-9};
  one.log_scales = {-3, std::log(0.5f), -INFINITY};
  const Framing framing = FrameCloud(one);
  EXPECT_EQ(framing.target[1], 4);
  EXPECT_NEAR(framing.radius, 1.5, 1e-6);  // three times its longest axis
  one.log_scales = {-INFINITY, NAN, INFINITY};
  EXPECT_EQ(FrameCloud(one).radius, 1);
}

TEST(Framing, DistanceFitsTheSphereIntoTheSmallerSide) {
  const Pinhole wide = PinholeFromFov(200, 100, std::numbers::pi / 2);  // half height: atan(0.5)
  EXPECT_NEAR(FramingDistance({{0, 0, 0}, 1}, wide), 1.1 / std::sin(std::atan(0.5)), 1e-9);
}

}  // namespace
}  // namespace anchorsplat
