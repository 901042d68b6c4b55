#include "core/framing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/random.h"

namespace anchorsplat {
namespace {

// Gaussians of an eighth of a unit or so, as opaque as not.
GaussianCloud Cloud(size_t n) {
  GaussianCloud cloud;
  cloud.Resize(static_cast<int64_t>(n), 0);
  std::ranges::fill(cloud.log_scales, -2.0f);
  std::ranges::fill(cloud.quats, 0.5f);
  std::ranges::fill(cloud.opacity_logits, 1.0f);
  std::ranges::fill(cloud.sh, 0.0f);
  return cloud;
}

// The surface of a cube of two units.
GaussianCloud Cube(size_t n, const std::array<double, 3>& center, uint64_t seed = 3) {
  GaussianCloud cloud = Cloud(n);
  Random random(seed);
  for (size_t i = 0; i < n; ++i) {
    for (size_t a = 0; a < 3; ++a) {
      const double on_face = i % 6 % 2 == 0 ? -1 : 1;
      const double x = a == i % 6 / 2 ? on_face : random.Uniform(-1, 1);
      cloud.means[3 * i + a] = static_cast<float>(center[a] + x);
    }
  }
  return cloud;
}

// In all directions from zero, `nearest` to `farthest` away.
GaussianCloud Shell(size_t n, double nearest, double farthest, float log_scale, uint64_t seed = 4) {
  GaussianCloud cloud = Cloud(n);
  Random random(seed);
  std::ranges::fill(cloud.log_scales, log_scale);
  for (size_t i = 0; i < n; ++i) {
    std::array<double, 3> d{};
    for (double& x : d) x = random.Normal();
    const double factor = random.Uniform(nearest, farthest) / std::hypot(d[0], d[1], d[2]);
    for (size_t a = 0; a < 3; ++a) cloud.means[3 * i + a] = static_cast<float>(factor * d[a]);
  }
  return cloud;
}

GaussianCloud Together(GaussianCloud cloud, const GaussianCloud& more) {
  EXPECT_TRUE(Append(cloud, more).ok());
  return cloud;
}

TEST(Framing, IgnoresOutliersAndHaze) {
  GaussianCloud cloud = Cloud(1000);
  Random random(3);
  for (size_t i = 0; i < 1000; ++i) {
    for (size_t a = 0; a < 3; ++a) cloud.means[3 * i + a] = static_cast<float>(10 + random.Uniform(-1, 1));
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

TEST(Framing, NeitherFloatersNorSkiesMakeTheObjectSmall) {
  const GaussianCloud object = Cube(3000, {0, 0, 0});
  const double alone = FrameCloud(object).radius;
  for (const size_t more : {size_t{30}, size_t{93}, size_t{333}, size_t{1285}}) {  // 1, 3, 10 and 30 %
    for (const auto& [kind, cloud] :
         {std::pair("near", Shell(more, 3, 7, -2)), std::pair("far", Shell(more, 18, 60, -1)),
          std::pair("sky", Shell(more, 190, 200, 3)), std::pair("strays", Shell(more, 1e5, 1e30, 0))}) {
      const Framing framing = FrameCloud(Together(object, cloud));
      EXPECT_LT(framing.radius, 1.7 * alone) << more << " " << kind;
      EXPECT_GT(framing.radius, 0.9 * alone) << more << " " << kind;
      for (const double x : framing.target) EXPECT_NEAR(x, 0, 0.6) << more << " " << kind;
    }
  }
}

TEST(Framing, KeepsOtherObjects) {
  const GaussianCloud object = Cube(3000, {0, 0, 0});
  for (const double away : {4.0, 10.0, 60.0}) {
    for (const size_t more : {size_t{700}, size_t{2000}, size_t{3000}}) {
      const GaussianCloud two = Together(object, Cube(more, {away, 0, 0}, 8));
      EXPECT_GT(FrameCloud(two).radius, away / 2) << away << " " << more;
      const GaussianCloud three = Together(two, Cube(more, {0, -away, 0}, 9));
      EXPECT_GT(FrameCloud(three).radius, 0.6 * away) << away << " " << more;
    }
  }
}

TEST(Framing, KeepsWallsAndFlatThings) {
  // A room with more Gaussians on what stands in its middle than on its walls.
  GaussianCloud walls = Cube(4000, {0, 0, 0}, 5);
  for (float& x : walls.means) x *= 5;
  std::ranges::fill(walls.log_scales, -1.0f);
  GaussianCloud thing = Cube(6000, {0, 0, 0}, 6);
  std::ranges::fill(thing.log_scales, -3.0f);
  EXPECT_GT(FrameCloud(Together(thing, walls)).radius, 5);
  GaussianCloud flat = Cube(2000, {0, 0, 0});
  for (size_t i = 2; i < flat.means.size(); i += 3) flat.means[i] = 7;
  EXPECT_NEAR(FrameCloud(flat).target[2], 7, 1e-6);
  EXPECT_NEAR(FrameCloud(flat).radius, 1.3, 0.15);
}

TEST(Framing, WhatNobodyDrawsDoesNotCount) {
  GaussianCloud cloud = Cube(500, {0, 0, 0});
  const Framing without = FrameCloud(cloud);
  GaussianCloud undrawn = Cube(400, {100, 0, 0});
  for (size_t i = 0; i < 400; ++i) undrawn.log_scales[3 * i + i % 3] = i % 2 == 0 ? 60 : INFINITY;
  const Framing with = FrameCloud(Together(cloud, undrawn));
  EXPECT_EQ(with.target, without.target);
  EXPECT_EQ(with.radius, without.radius);
}

TEST(Framing, AlwaysHasARadius) {
  EXPECT_EQ(FrameCloud(GaussianCloud{}).radius, 1);
  GaussianCloud one;
  one.Resize(1, 0);
  one.means = {3, 4, 5};
  one.quats = {1, 0, 0, 0};
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
