#include "fit/view_pose.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"
#include "fit/orbit_scene_for_test.h"

namespace anchorsplat {
namespace {

constexpr std::array<double, 6> kNowhere{};

Image Shown(const GaussianCloud& cloud, const Camera& camera) {
  Rasterizer rasterizer;
  RenderOutput output;
  EXPECT_TRUE(rasterizer.Render(cloud, camera, {}, output).ok());
  return output.color;
}

// The largest distance, in pixels, between where two cameras see points of the ball.
double FarthestApart(const Camera& a, const Camera& b) {
  double most = 0;
  for (const double x : {-0.25, 0.0, 0.25}) {
    for (const double y : {-0.25, 0.0, 0.25}) {
      for (const double z : {-0.2, 0.2}) {
        const auto p = a.ToCamera({x, y, z}), q = b.ToCamera({x, y, z});
        most = std::max(most, a.intrinsics.fx * std::abs(p[0] / p[2] - q[0] / q[2]));
        most = std::max(most, a.intrinsics.fy * std::abs(p[1] / p[2] - q[1] / q[2]));
      }
    }
  }
  return most;
}

TEST(ViewPose, MotionIsWhatLeadsThere) {
  const Camera camera = orbit_scene::Cameras(5, 40, 30).cameras[3];
  const std::array<double, 6> motion = {0.01, -0.02, 0.03, 0.1, 0.2, -0.3};
  const auto found = MotionBetween(camera, Moved(camera, motion));
  for (size_t i = 0; i < 6; ++i) EXPECT_NEAR(found[i], motion[i], 1e-12) << i;
  for (const double x : MotionBetween(camera, Moved(camera, kNowhere))) EXPECT_NEAR(x, 0, 1e-12);
  // A rotation about the camera's own y moves what is in front of it to the right, a shift likewise.
  const std::array<double, 3> ahead = {0, 0, 0};
  EXPECT_GT(Moved(camera, {0, 0.01, 0, 0, 0, 0}).ToCamera(ahead)[0], camera.ToCamera(ahead)[0]);
  EXPECT_NEAR(Moved(camera, {0, 0, 0, 0.1, 0, 0}).ToCamera(ahead)[0], camera.ToCamera(ahead)[0] + 0.1, 1e-12);
}

TEST(ViewPose, FindsWhereAPictureWasTaken) {
  const GaussianCloud ball = orbit_scene::Ball(400, 1);
  Random random(2);
  PoseAligner aligner;
  for (const Camera& truth : orbit_scene::Cameras(6, 96, 96).cameras) {
    std::array<double, 6> off;
    const double pixel = 1 / truth.intrinsics.fx;
    for (size_t i = 0; i < 6; ++i) off[i] = random.Uniform(-1, 1) * pixel * (i < 3 ? 1 : 1.7);
    const Camera said = Moved(truth, off);
    ASSERT_GT(FarthestApart(truth, said), 0.3);
    const Image picture = Shown(ball, truth);
    const auto found = aligner.Align(ball, {}, said, said, picture, false, 6);
    ASSERT_TRUE(found.ok()) << found.error().message;
    EXPECT_LT(FarthestApart(truth, *found), 0.05) << truth.name << ": was " << FarthestApart(truth, said);
    // The same again from there changes nothing to speak of, and the origin bounds it.
    const auto again = aligner.Align(ball, {}, said, *found, picture, false, 1);
    EXPECT_LT(FarthestApart(*again, *found), 0.02);
  }
}

TEST(ViewPose, ExposureIsNoMotion) {
  const GaussianCloud ball = orbit_scene::Ball(400, 1);
  const Camera truth = orbit_scene::Cameras(5, 96, 96).cameras[2];
  const Camera said = Moved(truth, {0, 0.8 / truth.intrinsics.fx, 0, 0, 0, 0});
  Image picture = Shown(ball, truth);
  for (float& x : picture.pixels) x = 0.8f * x + 0.02f;
  PoseAligner aligner;
  const auto found = aligner.Align(ball, {}, said, said, picture, true, 6);
  ASSERT_TRUE(found.ok());
  EXPECT_LT(FarthestApart(truth, *found), 0.06);
}

TEST(ViewPose, StaysWhereNothingTells) {
  const GaussianCloud ball = orbit_scene::Ball(50, 1);
  const Camera camera = orbit_scene::Cameras(5, 64, 64).cameras[2];
  PoseAligner aligner;
  const Camera away = Moved(camera, {0, 2.5, 0, 0, 0, 0});
  const auto nothing = aligner.Align(ball, {}, away, away, Image(64, 64, 3), false, 3);
  ASSERT_TRUE(nothing.ok());
  EXPECT_EQ(nothing->world_to_camera.rotation, away.world_to_camera.rotation);
  EXPECT_FALSE(aligner.Align(ball, {}, camera, camera, Image(32, 64, 3), false, 1).ok());

  // However wrong the picture, the pose is bounded.
  Image noise(64, 64, 3);
  Random random(3);
  for (float& x : noise.pixels) x = static_cast<float>(random.Uniform());
  const auto bounded = aligner.Align(ball, {}, camera, camera, noise, false, 40);
  ASSERT_TRUE(bounded.ok());
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_LE(std::abs(MotionBetween(camera, *bounded)[i]), 1.001 * kMostAligned / 16) << i;
  }
}

}  // namespace
}  // namespace anchorsplat
