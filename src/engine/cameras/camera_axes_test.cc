#include "cameras/camera_axes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

namespace anchorsplat {
namespace {

using Vec3 = std::array<double, 3>;

constexpr int kViews = 12;

// Cameras on a circle of `radius` about the origin, in the plane across `up`; they look at target(their centre).
CameraSet Circle(double radius, const Vec3& up, const std::function<Vec3(const Vec3&)>& target) {
  CameraSet set;
  set.source = CameraSource::kTransforms;
  for (int i = 0; i < kViews; ++i) {
    const double angle = 2 * std::numbers::pi * i / kViews, x = radius * std::cos(angle), y = radius * std::sin(angle);
    const Vec3 center = up[2] != 0 ? Vec3{x, y, 0.3} : Vec3{x, 0.3, y};
    Camera& camera = set.cameras.emplace_back();
    camera.intrinsics = {40, 30, 40, 40, 20, 15};
    camera.world_to_camera = *LookAt(center, target(center), up);
  }
  return set;
}

// As the reader gives it where the file's axes are the other ones.
CameraSet Misread(CameraSet set) {
  for (Camera& camera : set.cameras) {
    Pose& pose = camera.world_to_camera;
    for (size_t k = 3; k < 9; ++k) pose.rotation[k] = -pose.rotation[k];
    for (size_t k = 1; k < 3; ++k) pose.translation[k] = -pose.translation[k];
  }
  return set;
}

Vec3 Middle(const Vec3&) { return {0, 0, 0}; }
Vec3 Outwards(const Vec3& center) { return {2 * center[0], 2 * center[1], 2 * center[2]}; }

// Points on a sphere about the origin, evenly.
std::vector<float> Sphere(float radius) {
  std::vector<float> points;
  for (int i = 0; i < 500; ++i) {
    const double z = 1 - (2 * i + 1) / 500.0, around = std::sqrt(1 - z * z), angle = 2.4 * i;
    for (const double x : {around * std::cos(angle), around * std::sin(angle), z}) {
      points.push_back(static_cast<float>(radius * x));
    }
  }
  return points;
}

TEST(WrongAxes, OrbitsThatLookAway) {
  for (const Vec3& up : {Vec3{0, -1, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}}) {
    const CameraSet orbit = Circle(4, up, Middle), misread = Misread(orbit);
    EXPECT_EQ(WrongAxes(orbit, {}), "");
    EXPECT_EQ(WrongAxes(orbit, Sphere(1)), "");
    EXPECT_NE(WrongAxes(misread, {}).find("\"camera_axes\": \"opencv\""), std::string::npos) << up[1] << up[2];
    EXPECT_NE(WrongAxes(misread, Sphere(1)).find("see 0 % of the scene"), std::string::npos)
        << WrongAxes(misread, Sphere(1));
    CameraSet colmap = misread;
    colmap.source = CameraSource::kColmap;
    EXPECT_EQ(WrongAxes(colmap, {}), "") << "its axes are known";
  }
}

// From the middle of a room outwards: both ways show walls.
TEST(WrongAxes, RoomsAreNotAccused) {
  const CameraSet room = Circle(0.5, {0, 0, 1}, Outwards);
  EXPECT_EQ(WrongAxes(room, Sphere(5)), "");
  EXPECT_EQ(WrongAxes(room, {}), "");
  EXPECT_EQ(WrongAxes(Circle(0.5, {0, -1, 0}, Outwards), Sphere(5)), "");
}

TEST(WrongAxes, ForwardFacingSets) {
  CameraSet set;
  set.source = CameraSource::kTransforms;
  for (int i = 0; i < kViews; ++i) {
    Camera& camera = set.cameras.emplace_back();
    camera.intrinsics = {40, 30, 40, 40, 20, 15};
    camera.world_to_camera = *LookAt({0.1 * i, 0.05 * (i % 3), -6}, {0.1 * i, 0, 0}, {0, -1, 0});
  }
  EXPECT_EQ(WrongAxes(set, {}), "");
  EXPECT_EQ(WrongAxes(set, Sphere(1)), "");
  EXPECT_NE(WrongAxes(Misread(set), Sphere(1)), "");
  EXPECT_EQ(WrongAxes(CameraSet(), Sphere(1)), "");
}

}  // namespace
}  // namespace anchorsplat
