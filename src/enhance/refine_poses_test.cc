#include "enhance/refine_poses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/framing.h"
#include "fit/orbit_scene_test.h"

namespace anchorsplat {
namespace {

using testing::HasSubstr;

double Distance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

TEST(PosesAround, LookAtTheObjectWithTheGivenPixels) {
  const GaussianCloud ball = orbit_scene::Ball(500, 1);
  const Framing framing = FrameCloud(ball);
  const auto poses = PosesAround(ball, 0.01, 40, 3);
  ASSERT_TRUE(poses.ok()) << poses.error().message;
  ASSERT_EQ(poses->size(), 40u);
  std::array<double, 3> mean{};
  for (const Camera& pose : *poses) {
    const Pinhole& k = pose.intrinsics;
    const auto target = pose.ToCamera(framing.target);
    EXPECT_NEAR(target[2] / k.fx, 0.01, 1e-9) << "world size of a pixel at the middle";
    EXPECT_NEAR(target[0], 0, 1e-9);
    EXPECT_NEAR(target[1], 0, 1e-9);
    EXPECT_NEAR(2 * std::atan(0.5 * k.width / k.fx), std::numbers::pi / 4, 0.01);
    for (int64_t i = 0; i < ball.size(); ++i) {
      const float* p = ball.means.data() + 3 * i;
      const auto c = pose.ToCamera({p[0], p[1], p[2]});
      EXPECT_LT(std::abs(k.fx * c[0] / c[2]), 0.5 * k.width);
      EXPECT_LT(std::abs(k.fy * c[1] / c[2]), 0.5 * k.height);
    }
    for (size_t a = 0; a < 3; ++a) mean[a] += pose.Center()[a] / 40;
  }
  EXPECT_LT(Distance(mean, framing.target), 0.05 * Distance(poses->front().Center(), framing.target))
      << "evenly spread";
  // Another seed, other places.
  EXPECT_GT(Distance(PosesAround(ball, 0.01, 40, 4)->front().Center(), poses->front().Center()), 1e-3);
}

TEST(PosesAround, NotFromWithin) {
  // Furniture in the middle of a room whose walls stand where the poses would: too few Gaussians to be framed.
  GaussianCloud room = orbit_scene::Ball(50000, 1);
  const double distance = FramingDistance(FrameCloud(room), PinholeFromFov(100, 100, std::numbers::pi / 4));
  GaussianCloud walls = orbit_scene::Ball(500, 2);
  Random random(3);
  for (int64_t i = 0; i < walls.size(); ++i) {
    double v[3];
    for (double& x : v) x = random.Normal();
    const double scale = distance / std::hypot(v[0], v[1], v[2]);
    for (size_t a = 0; a < 3; ++a) {
      walls.means[static_cast<size_t>(3 * i) + a] = static_cast<float>(scale * v[a]);
      walls.log_scales[static_cast<size_t>(3 * i) + a] = -2;
    }
  }
  ASSERT_EQ(PosesAround(room, 0.01, 20, 1)->size(), 20u);
  GaussianCloud both = room;
  ASSERT_TRUE(Append(both, walls).ok());
  const auto poses = PosesAround(both, 0.01, 20, 1);
  ASSERT_FALSE(poses.ok());
  EXPECT_THAT(poses.error().message, HasSubstr("--cameras"));
  // Walls that nobody would see hide nothing.
  for (int64_t i = room.size(); i < both.size(); ++i) both.opacity_logits[static_cast<size_t>(i)] = -4;
  EXPECT_EQ(PosesAround(both, 0.01, 20, 1)->size(), 20u);
}

TEST(PosesAround, RefusesNonsense) {
  const GaussianCloud ball = orbit_scene::Ball(50, 1);
  EXPECT_FALSE(PosesAround(ball, 0, 10, 1).ok());
  EXPECT_FALSE(PosesAround(ball, std::nan(""), 10, 1).ok());
  EXPECT_FALSE(PosesAround(ball, 0.01, 0, 1).ok());
  EXPECT_THAT(PosesAround(ball, 1e-9, 10, 1).error().message, HasSubstr("training pixel"));
  // Pixels larger than the object still make a picture.
  EXPECT_GE(PosesAround(ball, 5, 10, 1)->front().intrinsics.width, 32);
}

TEST(PosesAlong, HalfWayToTheNeighbours) {
  const std::vector<Camera> cameras = orbit_scene::Cameras(300, 64, 48).cameras;
  EXPECT_EQ(PosesAlong(cameras, 0).size(), cameras.size());
  const std::vector<Camera> poses = PosesAlong(cameras, 2);
  ASSERT_EQ(poses.size(), 3 * cameras.size());
  for (size_t i = 0; i < cameras.size(); ++i) EXPECT_EQ(poses[i].name, cameras[i].name);
  for (size_t i = cameras.size(); i < poses.size(); ++i) {
    const Camera& from = cameras[(i - cameras.size()) / 2];
    EXPECT_TRUE(poses[i].image.empty());
    EXPECT_EQ(poses[i].intrinsics.width, 64);
    // Still looks at the middle, from a little nearer.
    const auto target = poses[i].ToCamera({0, 0, 0});
    EXPECT_NEAR(target[0], 0, 0.1);
    EXPECT_NEAR(target[1], 0, 0.1);
    EXPECT_NEAR(target[2], 1.7, 0.02);
    EXPECT_LT(Distance(poses[i].Center(), from.Center()), 0.2);
  }
}

TEST(PosesAlong, OnlyBetweenCamerasThatLookTheSameWay) {
  std::vector<Camera> cameras = orbit_scene::Cameras(2, 64, 48).cameras;  // opposite each other
  EXPECT_EQ(PosesAlong(cameras, 1).size(), 2u);
  cameras.push_back(cameras[0]);
  cameras[2].intrinsics.fx *= 2;
  EXPECT_EQ(PosesAlong(cameras, 1).size(), 3u);
}

}  // namespace
}  // namespace anchorsplat
