#include "core/camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <set>

namespace anchorsplat {
namespace {

using Vec3 = std::array<double, 3>;

void ExpectNear(const Vec3& a, const Vec3& b) {
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(a[k], b[k], 1e-12) << k;
}

TEST(Camera, LookAtUsesOpenCvAxes) {
  const auto pose = LookAt({0, 0, -5}, {0, 0, 0}, {0, 1, 0});
  ASSERT_TRUE(pose.ok());
  Camera camera;
  camera.world_to_camera = *pose;
  ExpectNear(camera.Center(), {0, 0, -5});
  ExpectNear(camera.ToCamera({0, 0, 0}), {0, 0, 5});   // in front is +z
  ExpectNear(camera.ToCamera({0, 1, 0}), {0, -1, 5});  // up is −y
  // Right-handed: looking along +z with +y up, +x of the world is on the left.
  ExpectNear(camera.ToCamera({1, 0, 0}), {-1, 0, 5});
}

TEST(Camera, LookAtAlongUpStillIsARotation) {
  const auto pose = LookAt({1, 2, 3}, {1, -7, 3}, {0, 1, 0});
  ASSERT_TRUE(pose.ok());
  const auto& r = pose->rotation;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      const double dot = r[3 * i] * r[3 * j] + r[3 * i + 1] * r[3 * j + 1] + r[3 * i + 2] * r[3 * j + 2];
      EXPECT_NEAR(dot, i == j ? 1 : 0, 1e-12);
    }
  }
}

TEST(Camera, LookAtRefusesTheImpossible) {
  EXPECT_FALSE(LookAt({1, 2, 3}, {1, 2, 3}, {0, 1, 0}).ok());
  EXPECT_FALSE(LookAt({std::nan(""), 0, 0}, {1, 2, 3}, {0, 1, 0}).ok());
  EXPECT_FALSE(LookAt({0, 0, 0}, {1, 2, 3}, {0, std::numeric_limits<double>::infinity(), 0}).ok());
}

TEST(Camera, OpenGlMatricesGoThereAndBack) {
  const auto pose = LookAt({3, -1, 2}, {0.5, 0, 0}, {0, 0, 1});
  ASSERT_TRUE(pose.ok());
  const auto matrix = OpenGlCameraToWorld(*pose);
  EXPECT_NEAR(matrix[3], 3, 1e-12);  // the last column is the camera's place
  EXPECT_NEAR(matrix[7], -1, 1e-12);
  EXPECT_NEAR(matrix[11], 2, 1e-12);
  const auto back = PoseFromOpenGlCameraToWorld(matrix);
  ASSERT_TRUE(back.ok());
  for (size_t k = 0; k < 9; ++k) EXPECT_NEAR(back->rotation[k], pose->rotation[k], 1e-12);
  ExpectNear(back->translation, pose->translation);
}

TEST(Camera, OpenGlMatricesMustBeRotations) {
  std::array<double, 16> m = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  EXPECT_TRUE(PoseFromOpenGlCameraToWorld(m).ok());
  m[0] = 2;  // stretched
  EXPECT_FALSE(PoseFromOpenGlCameraToWorld(m).ok());
  m[0] = -1;  // mirrored
  EXPECT_FALSE(PoseFromOpenGlCameraToWorld(m).ok());
  EXPECT_NE(PoseFromOpenGlCameraToWorld(m).error().message.find("it mirrors"), std::string::npos);
  for (const size_t k : {0, 5, 10}) m[k] = 1.5;
  EXPECT_NE(PoseFromOpenGlCameraToWorld(m).error().message.find("it scales by 1.5"), std::string::npos);
  m[0] = std::nan("");
  EXPECT_FALSE(PoseFromOpenGlCameraToWorld(m).ok());
}

TEST(Camera, ScalingKeepsTheFieldOfView) {
  const Pinhole view = PinholeFromFov(640, 480, std::numbers::pi / 2);
  EXPECT_NEAR(view.fx, 320, 1e-9);
  EXPECT_NEAR(view.cx, 320, 1e-9);
  const Pinhole half = Scaled(view, 0.5);
  EXPECT_EQ(half.width, 320);
  EXPECT_EQ(half.height, 240);
  EXPECT_NEAR(half.fx, 160, 1e-9);
  EXPECT_NEAR(half.cy, 120, 1e-9);
  const Pinhole uneven = Scaled({101, 51, 100, 100, 50.5, 25.5}, 0.5);  // 50.5 × 25.5 pixels do not exist
  EXPECT_NEAR(uneven.fx / uneven.width, 100.0 / 101, 1e-12);
  EXPECT_NEAR(uneven.cy / uneven.height, 0.5, 1e-12);
  EXPECT_EQ(Scaled(view, 1e-9).width, 1);
}

TEST(Camera, OrbitLooksAtItsTargetFromAllSides) {
  const Vec3 target = {1, 2, 3};
  const auto orbit = OrbitCameras(50, 4, target, PinholeFromFov(64, 64, 1));
  ASSERT_TRUE(orbit.ok());
  ASSERT_EQ(orbit->cameras.size(), 50u);
  Vec3 mean = {0, 0, 0};
  std::set<std::string> names;
  for (const Camera& camera : orbit->cameras) {
    ExpectNear(camera.ToCamera(target), {0, 0, 4});
    for (size_t k = 0; k < 3; ++k) mean[k] += camera.Center()[k] / 50;
    names.insert(camera.name);
  }
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(mean[k], target[k], 0.1);
  EXPECT_EQ(names.size(), 50u);
  EXPECT_FALSE(OrbitCameras(0, 4, target, {}).ok());
  EXPECT_FALSE(OrbitCameras(5, 0, target, {}).ok());
  EXPECT_FALSE(OrbitCameras(5, std::nan(""), target, {}).ok());
}

}  // namespace
}  // namespace anchorsplat
