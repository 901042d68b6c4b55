#include "scene/camera_rig.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <set>

namespace anchorsplat {
namespace {

double Length(const std::array<double, 3>& a) { return std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); }

TEST(CameraRig, EveryKindLooksAtTheOriginFromItsDistance) {
  for (const RigKind kind : {RigKind::kSphere, RigKind::kRings, RigKind::kRandom}) {
    auto set = MakeRig({.kind = kind, .views = 23, .radius = 1.7}, 64, 32);
    ASSERT_TRUE(set.ok());
    ASSERT_EQ(set->cameras.size(), 23u);
    std::set<std::array<double, 3>> places;
    for (const Camera& camera : set->cameras) {
      EXPECT_NEAR(Length(camera.Center()), 1.7, 1e-12);
      const auto origin = camera.ToCamera({0, 0, 0});
      EXPECT_NEAR(origin[0], 0, 1e-12);
      EXPECT_NEAR(origin[1], 0, 1e-12);
      EXPECT_NEAR(origin[2], 1.7, 1e-12);
      // y is up: what stands above the origin is seen above it, that is at smaller y.
      EXPECT_LE(camera.ToCamera({0, 0.1, 0})[1], 1e-9);
      places.insert(camera.Center());
    }
    EXPECT_EQ(places.size(), 23u);
    EXPECT_EQ(set->cameras[7].name, "007");
    EXPECT_NEAR(set->cameras[0].intrinsics.fx, 32 / std::tan(std::numbers::pi / 8), 1e-9);
  }
}

TEST(CameraRig, RingsStandAtTheirElevations) {
  auto set = MakeRig({.kind = RigKind::kRings, .views = 8, .radius = 2, .elevations = {-30, 45}}, 8, 8);
  ASSERT_TRUE(set.ok());
  for (size_t i = 0; i < 8; ++i) {
    EXPECT_NEAR(set->cameras[i].Center()[1], i % 2 == 0 ? -1 : std::sqrt(2.0), 1e-12);
  }
}

TEST(CameraRig, RandomIsTheSeedsAlone) {
  const auto centers = [](uint64_t seed) {
    return MakeRig({.kind = RigKind::kRandom, .views = 3, .seed = seed}, 8, 8)->cameras[2].Center();
  };
  EXPECT_EQ(centers(5), centers(5));
  EXPECT_NE(centers(5), centers(6));
}

TEST(CameraRig, NamesSortAsTheViews) {
  auto set = MakeRig({.views = 1001}, 8, 8);
  ASSERT_TRUE(set.ok());
  EXPECT_EQ(set->cameras[7].name, "0007");
  EXPECT_EQ(set->cameras[1000].name, "1000");
  EXPECT_EQ(MakeRig({.views = 1000}, 8, 8)->cameras[999].name, "999");
}

TEST(CameraRig, RefusesTheImpossible) {
  EXPECT_FALSE(MakeRig({.views = 0}, 8, 8).ok());
  EXPECT_FALSE(MakeRig({.views = 100001}, 8, 8).ok());
  EXPECT_FALSE(MakeRig({.radius = 0}, 8, 8).ok());
  EXPECT_FALSE(MakeRig({.radius = std::numeric_limits<double>::infinity()}, 8, 8).ok());
  EXPECT_FALSE(MakeRig({.fov_degrees = 180}, 8, 8).ok());
  EXPECT_FALSE(MakeRig({.kind = RigKind::kRings, .elevations = {}}, 8, 8).ok());
  EXPECT_FALSE(MakeRig({.kind = RigKind::kRings, .elevations = {91}}, 8, 8).ok());
}

}  // namespace
}  // namespace anchorsplat
