#include "core/world_up.h"

#include <gtest/gtest.h>

#include <cmath>

namespace anchorsplat {
namespace {

using Vec3 = std::array<double, 3>;

std::vector<Camera> Orbit(const Vec3& up) {
  std::vector<Camera> cameras;
  for (int i = 0; i < 12; ++i) {
    const double angle = 0.5 * i;
    // Around `up`, and somewhat above.
    const Vec3 side = std::abs(up[0]) < 0.5 ? Vec3{1, 0, 0} : Vec3{0, 0, 1};
    const Vec3 other = {up[1] * side[2] - up[2] * side[1], up[2] * side[0] - up[0] * side[2],
                        up[0] * side[1] - up[1] * side[0]};
    Vec3 center;
    for (size_t k = 0; k < 3; ++k) {
      center[k] = 3 * (std::cos(angle) * side[k] + std::sin(angle) * other[k]) + up[k];
    }
    cameras.emplace_back().world_to_camera = *LookAt(center, {0, 0, 0}, up);
  }
  return cameras;
}

TEST(WorldUp, IsWhatTheCamerasHoldUpright) {
  for (const Vec3& up : {Vec3{0, 1, 0}, Vec3{0, -1, 0}, Vec3{0, 0, 1}, Vec3{-1, 0, 0}}) {
    EXPECT_EQ(WorldUp(Orbit(up)), up);
  }
  const double s = std::sqrt(0.5);
  const auto slanted = WorldUp(Orbit({0, s, s}));
  ASSERT_TRUE(slanted);
  EXPECT_NEAR((*slanted)[1], s, 0.1);
  EXPECT_NEAR((*slanted)[2], s, 0.1);
}

TEST(WorldUp, IsUnknownWithoutCamerasAndWhereTheyCancelOut) {
  EXPECT_FALSE(WorldUp({}));
  std::vector<Camera> cameras = Orbit({0, 1, 0});
  const std::vector<Camera> down = Orbit({0, -1, 0});
  cameras.insert(cameras.end(), down.begin(), down.end());
  EXPECT_FALSE(WorldUp(cameras));
}

TEST(WorldUp, TurnsCamerasAboutTheirTarget) {
  const Vec3 target = {1, 2, 3};
  const CameraSet orbit = *OrbitCameras(9, 2, target, PinholeFromFov(64, 64, 1));
  for (const Vec3& up : {Vec3{0, -2, 0}, Vec3{0, 0, 1}, Vec3{1, 0, 0}, Vec3{-1, 1, 2}}) {
    std::vector<Camera> cameras = orbit.cameras;
    TurnUp(target, up, cameras);
    const double length = std::hypot(up[0], up[1], up[2]);
    for (size_t i = 0; i < cameras.size(); ++i) {
      const auto seen = cameras[i].ToCamera(target);
      EXPECT_NEAR(seen[0], 0, 1e-9);
      EXPECT_NEAR(seen[1], 0, 1e-9);
      EXPECT_NEAR(seen[2], 2, 1e-9);
      // As high above the target as it was, along the new up; and upright as it was.
      const auto was = orbit.cameras[i].Center(), is = cameras[i].Center();
      double height = 0, upright = 0;
      for (size_t k = 0; k < 3; ++k) {
        height += (is[k] - target[k]) * up[k] / length;
        upright += cameras[i].world_to_camera.rotation[3 + k] * up[k] / length;
      }
      EXPECT_NEAR(height, was[1] - target[1], 1e-9);
      EXPECT_NEAR(upright, orbit.cameras[i].world_to_camera.rotation[4], 1e-9);
    }
  }
  std::vector<Camera> same = orbit.cameras;
  TurnUp(target, {0, 1, 0}, same);
  EXPECT_EQ(same[3].world_to_camera.rotation, orbit.cameras[3].world_to_camera.rotation);
  EXPECT_EQ(same[3].world_to_camera.translation, orbit.cameras[3].world_to_camera.translation);
}

}  // namespace
}  // namespace anchorsplat
