#include "enhance/cloud_shape.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/random.h"

namespace anchorsplat {
namespace {

// Gaussians of one size anywhere in a plate of 2 × 1 × 0.1, those for which `keep` holds of (x, y).
template <typename Keep>
GaussianCloud Plate(int64_t count, Keep&& keep) {
  GaussianCloud cloud;
  cloud.Resize(count, 0);
  std::ranges::fill(cloud.log_scales, -4.0f);
  Random random(11);
  for (size_t i = 0; i < static_cast<size_t>(count);) {
    const double x = random.Uniform(-1, 1), y = random.Uniform(-0.5, 0.5);
    if (!keep(x, y)) continue;
    cloud.means[3 * i] = static_cast<float>(x);
    cloud.means[3 * i + 1] = static_cast<float>(y);
    cloud.means[3 * i + 2] = static_cast<float>(0.1 * random.Uniform());
    cloud.quats[4 * i] = 1;
    ++i;
  }
  return cloud;
}

TEST(CloudShape, PlatesFillTheirRectangleAndCrossesDoNot) {
  const GaussianCloud plate = Plate(4000, [](double, double) { return true; });
  EXPECT_NEAR(ShapeOf(plate).flatness, 0.1, 0.01);
  EXPECT_GT(ShapeOf(plate).fill, 0.98);
  const CloudShape cross =
      ShapeOf(Plate(4000, [](double x, double y) { return std::abs(x) < 0.2 || std::abs(y) < 0.1; }));
  EXPECT_NEAR(cross.fill, 1 - 0.8 * 0.8, 0.1);
  EXPECT_LT(cross.flatness, 0.2);
  // A disc: π / 4, and the cells that its edge goes through.
  EXPECT_NEAR(ShapeOf(Plate(4000, [](double x, double y) { return x * x + 4 * y * y < 1; })).fill, 0.9, 0.05);
}

TEST(CloudShape, NeitherUnitNorOrientationMatters) {
  const GaussianCloud plate = Plate(3000, [](double x, double y) { return x > 0 || y > 0; });
  GaussianCloud turned = plate;
  for (size_t i = 0; i < turned.means.size(); i += 3) {
    const float x = plate.means[i], y = plate.means[i + 1], z = plate.means[i + 2];
    turned.means[i] = 50 * (0.6f * x - 0.8f * z) + 7;
    turned.means[i + 1] = 50 * y - 3;
    turned.means[i + 2] = 50 * (0.8f * x + 0.6f * z);
  }
  EXPECT_NEAR(ShapeOf(turned).flatness, ShapeOf(plate).flatness, 1e-3);
  EXPECT_NEAR(ShapeOf(turned).fill, ShapeOf(plate).fill, 0.01);
}

TEST(CloudShape, RoundnessIsThatOfTheGaussians) {
  GaussianCloud cloud = Plate(500, [](double, double) { return true; });
  EXPECT_DOUBLE_EQ(ShapeOf(cloud).roundness, 1);
  for (size_t i = 0; i < cloud.log_scales.size(); i += 3) cloud.log_scales[i] += std::log(0.25f);
  EXPECT_NEAR(ShapeOf(cloud).roundness, 0.25, 1e-6);
}

TEST(CloudShape, OddClouds) {
  EXPECT_EQ(ShapeOf({}).fill, 1);
  GaussianCloud one = Plate(1, [](double, double) { return true; });
  EXPECT_EQ(ShapeOf(one).flatness, 1);
  GaussianCloud far = Plate(100, [](double, double) { return true; });
  for (float& x : far.means) x *= 1e38f;
  std::ranges::fill(far.log_scales, -std::numeric_limits<float>::infinity());  // flat
  const CloudShape shape = ShapeOf(far);
  EXPECT_TRUE(shape.fill >= 0 && shape.fill <= 1);
  EXPECT_EQ(shape.roundness, 0);
}

}  // namespace
}  // namespace anchorsplat
