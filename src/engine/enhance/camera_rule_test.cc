#include "enhance/camera_rule.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "cameras/camera_io.h"
#include "core/random.h"
#include "core/source_dir_for_test.h"
#include "formats/cloud_io.h"

namespace anchorsplat {
namespace {

// Opaque Gaussians within `radius` of a point.
GaussianCloud Cluster(const std::array<double, 3>& middle, double radius, int64_t n = 200) {
  GaussianCloud cloud;
  cloud.Resize(n, 0);
  std::fill(cloud.log_scales.begin(), cloud.log_scales.end(), -4.0f);
  std::fill(cloud.quats.begin(), cloud.quats.end(), 0.5f);
  std::fill(cloud.opacity_logits.begin(), cloud.opacity_logits.end(), 3.0f);
  std::fill(cloud.sh.begin(), cloud.sh.end(), 0.0f);
  Random random(3);
  for (size_t i = 0; i < static_cast<size_t>(3 * n); ++i) {
    cloud.means[i] = static_cast<float>(middle[i % 3] + random.Uniform(-radius, radius) / std::numbers::sqrt3);
  }
  return cloud;
}

Camera LookingFrom(const std::array<double, 3>& center, const std::array<double, 3>& target) {
  Camera camera;
  camera.intrinsics = {100, 100, 100, 100, 50, 50};
  camera.world_to_camera = *LookAt(center, target, {0, 1, 0});
  return camera;
}

// A ring at some elevation around a point, hand-held: neither equally far nor aimed exactly.
CameraSet Ring(const std::array<double, 3>& middle, double distance, double elevation, double arc, double shake,
               int views = 40) {
  Random random(5);
  CameraSet set;
  for (int i = 0; i < views; ++i) {
    const double angle = arc * i / views, r = distance * (1 + shake * random.Uniform(-1, 1));
    const double flat = r * std::cos(elevation);
    std::array<double, 3> target = middle;
    for (double& x : target) x += shake * distance * 0.3 * random.Uniform(-1, 1);
    set.cameras.push_back(LookingFrom(
        {middle[0] + flat * std::cos(angle), middle[1] + r * std::sin(elevation), middle[2] + flat * std::sin(angle)},
        target));
  }
  return set;
}

constexpr double kTurn = 2 * std::numbers::pi;

TEST(CameraRule, ExamplesAreSeenFromAllAround) {
  for (const char* object : {"biplane", "stone_lantern"}) {
    const auto folder = SourceDirForTest() / "examples" / object;
    const auto cloud = ReadCloud(folder / "input.ply");
    const auto cameras = ReadCameras(folder / "transforms_lr.json");
    ASSERT_TRUE(cloud.ok() && cameras.ok());
    const CameraRuleChoice choice = ChooseCameraRule(*cloud, *cameras);
    EXPECT_EQ(choice.rule, CameraPixelRule::kMedian) << object << ": " << choice.why;
  }
}

TEST(CameraRule, AHandHeldTurnIsAllAround) {
  const std::array<double, 3> middle = {40, -7, 3};
  for (const double elevation : {0.0, 0.5, 0.9}) {
    const auto choice = ChooseCameraRule(Cluster(middle, 0.6), Ring(middle, 2, elevation, kTurn, 0.15));
    EXPECT_EQ(choice.rule, CameraPixelRule::kMedian) << elevation << ": " << choice.why;
  }
}

TEST(CameraRule, AWalkThroughIsNot) {
  Random random(9);
  CameraSet walk;
  for (int i = 0; i < 60; ++i) {  // along a corridor, the head turning
    const double z = 0.2 * i, turn = 0.8 * std::sin(0.7 * i);
    walk.cameras.push_back(LookingFrom({0.1 * random.Normal(), 1.6, z}, {std::sin(turn), 1.5, z + std::cos(turn)}));
  }
  const auto choice = ChooseCameraRule(Cluster({0, 1.5, 6}, 6), walk);
  EXPECT_EQ(choice.rule, CameraPixelRule::kSmallest);
  EXPECT_FALSE(choice.why.empty());
}

TEST(CameraRule, InARoomOutwardsIsNot) {
  CameraSet outwards = Ring({0, 0, 0}, 0.5, 0.1, kTurn, 0.05);
  for (Camera& camera : outwards.cameras) {
    const auto center = camera.Center();
    camera = LookingFrom(center, {5 * center[0], 2 * center[1], 5 * center[2]});
  }
  EXPECT_EQ(ChooseCameraRule(Cluster({0, 0, 0}, 3), outwards).rule, CameraPixelRule::kSmallest);
}

TEST(CameraRule, OneSideCloseUpsAndSurroundingsAreNot) {
  const std::array<double, 3> middle = {0, 0, 0};
  const auto object = Cluster(middle, 0.6);
  EXPECT_EQ(ChooseCameraRule(object, Ring(middle, 2, 0.2, 0.6, 0.1)).rule, CameraPixelRule::kSmallest);
  CameraSet close_ups = Ring(middle, 2, 0.3, kTurn, 0.1);
  const CameraSet near = Ring(middle, 0.9, 0.3, kTurn, 0.1, 15);
  close_ups.cameras.insert(close_ups.cameras.end(), near.cameras.begin(), near.cameras.end());
  const auto choice = ChooseCameraRule(object, close_ups);
  EXPECT_EQ(choice.rule, CameraPixelRule::kSmallest);
  EXPECT_NE(choice.why.find("closer"), std::string::npos) << choice.why;
  CameraSet zoomed = Ring(middle, 2, 0.3, kTurn, 0.1);  // from the same places
  for (size_t k = 0; k < zoomed.cameras.size(); k += 4) {
    zoomed.cameras[k].intrinsics.fx *= 4;
    zoomed.cameras[k].intrinsics.fy *= 4;
  }
  const auto of_zoomed = ChooseCameraRule(object, zoomed);
  EXPECT_EQ(of_zoomed.rule, CameraPixelRule::kSmallest);
  EXPECT_NE(of_zoomed.why.find("times smaller pixels than others"), std::string::npos) << of_zoomed.why;
  // From so near that its front is half as far away as its middle.
  EXPECT_EQ(ChooseCameraRule(object, Ring(middle, 1.5, 0.3, kTurn, 0.1)).rule, CameraPixelRule::kMedian);
  EXPECT_EQ(ChooseCameraRule(object, Ring(middle, 0.7, 0.3, kTurn, 0.1)).rule, CameraPixelRule::kSmallest);
  // A table with a garden around it.
  GaussianCloud garden = object;
  ASSERT_TRUE(Append(garden, Cluster(middle, 20)).ok());
  EXPECT_EQ(ChooseCameraRule(garden, Ring(middle, 2, 0.3, kTurn, 0.1)).rule, CameraPixelRule::kSmallest);
}

TEST(CameraRule, FewOrEqualCamerasAreNot) {
  const std::array<double, 3> middle = {0, 0, 0};
  EXPECT_EQ(ChooseCameraRule(Cluster(middle, 0.6), Ring(middle, 2, 0, kTurn, 0, 4)).rule, CameraPixelRule::kSmallest);
  CameraSet same;
  same.cameras.assign(20, LookingFrom({0, 0, -2}, middle));
  EXPECT_EQ(ChooseCameraRule(Cluster(middle, 0.6), same).rule, CameraPixelRule::kSmallest);
}

}  // namespace
}  // namespace anchorsplat
