#include "enhance/refine_poses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/framing.h"
#include "fit/orbit_scene_for_test.h"

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
  ASSERT_GT(poses.size(), 2 * cameras.size());
  ASSERT_LT(poses.size(), 3 * cameras.size()) << "neighbours of each other share a place";
  for (size_t i = 0; i < cameras.size(); ++i) EXPECT_EQ(poses[i].name, cameras[i].name);
  for (size_t i = cameras.size(); i < poses.size(); ++i) {
    const std::string name = poses[i].name.substr(0, poses[i].name.find('+'));
    const Camera& from =
        *std::find_if(cameras.begin(), cameras.end(), [&](const Camera& camera) { return camera.name == name; });
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

double Nearest(const Camera& pose, const std::vector<Camera>& others) {
  double nearest = 1e9;
  for (const Camera& other : others) nearest = std::min(nearest, PoseDistance(pose, other, 1.7));
  return nearest;
}

TEST(PosesAlong, OneForEachPairOfCameras) {
  for (const int between : {1, 3}) {
    const std::vector<Camera> poses = PosesAlong(orbit_scene::Cameras(127, 64, 48).cameras, between);
    for (size_t i = 0; i < poses.size(); ++i) {
      for (size_t k = 0; k < i; ++k) {
        ASSERT_GT(PoseDistance(poses[i], poses[k], 1.7), 1e-6) << poses[i].name << " and " << poses[k].name;
      }
    }
  }
}

// What a refinement learned at says nothing about whether it helped elsewhere.
TEST(RefinePoses, NoCheckIsNearAPlaceThatIsLearnedFrom) {
  for (const int count : {8, 12, 40, 127}) {
    const std::vector<Camera> cameras = orbit_scene::Cameras(count, 64, 48).cameras;
    double apart = 0;  // nearest neighbours, on the mean
    for (size_t i = 0; i < cameras.size(); ++i) {
      std::vector<Camera> others = cameras;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
      apart += Nearest(cameras[i], others) / static_cast<double>(cameras.size());
    }
    for (const int between : {0, 1, 2, 5}) {
      const RefinePoses poses = RefinePosesAlong(cameras, between, 8);
      EXPECT_TRUE(poses.apart);
      // Of the few, nothing is between them: they look too differently.
      const bool few = count < 20;
      EXPECT_EQ(poses.check.size(), few ? cameras.size() / 6 : 8);
      EXPECT_EQ(std::ssize(poses.train) > std::ssize(cameras), !few && between > 0) << count << ", " << between;
      ASSERT_GE(poses.train.size() + (few ? poses.check.size() : 0), cameras.size());
      for (const Camera& check : poses.check) {
        EXPECT_GT(Nearest(check, poses.train), 0.2 * apart) << check.name << " of " << count << ", " << between;
      }
    }
  }
}

// Twins are nearest neighbours, and what is between them is what they see themselves.
TEST(RefinePoses, TwinsLeaveOtherPlacesToCheck) {
  std::vector<Camera> cameras = orbit_scene::Cameras(40, 64, 48).cameras;
  for (size_t i = 0; i < 40; ++i) {
    cameras.push_back(cameras[i]);
    cameras.back().name += " again";
    cameras.back().world_to_camera.translation[0] += 1e-3;
  }
  const RefinePoses poses = RefinePosesAlong(cameras, 1, 8);
  ASSERT_TRUE(poses.apart);
  for (const Camera& check : poses.check) EXPECT_GT(Nearest(check, poses.train), 0.05) << check.name;
  // Each has a twin, but what it has is not only its twin.
  EXPECT_EQ(poses.check.size(), 8u);
  // All in one place: there is nowhere else.
  cameras.assign(5, cameras[0]);
  const RefinePoses same = RefinePosesAlong(cameras, 1, 8);
  EXPECT_FALSE(same.apart);
  EXPECT_EQ(same.check.size(), 5u);
}

TEST(RefinePoses, AroundAnObjectSomeAreSetApart) {
  const GaussianCloud ball = orbit_scene::Ball(500, 1);
  for (const int64_t count : {1, 20, 128}) {
    const auto poses = RefinePosesAround(ball, 0.01, count, 8, 3);
    ASSERT_TRUE(poses.ok()) << poses.error().message;
    EXPECT_EQ(std::ssize(poses->train), count);
    EXPECT_EQ(poses->check.size(), 8u);
    // Places evenly spread over the sphere are 3.5/√n apart.
    for (const Camera& check : poses->check) {
      EXPECT_GT(Nearest(check, poses->train), 1.5 / std::sqrt(static_cast<double>(count) + 8)) << count;
    }
  }
}

}  // namespace
}  // namespace anchorsplat
