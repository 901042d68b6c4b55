#include "fit/initial_cloud.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "core/spherical_harmonics.h"
#include "formats/random_cloud_for_test.h"

namespace anchorsplat {
namespace {

InitialPoints Corners() {
  InitialPoints points;
  points.positions = {0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0, 2};
  points.colors = {0, 0.5f, 1, 1, 1, 1, 0.25f, 0.25f, 0.25f, 0, 0, 0};
  return points;
}

TEST(InitialCloud, FollowsThePoints) {
  const auto cloud = InitialCloud(Corners(), 1, {.opacity = 0.1, .sh_degree = 2, .seed = 3});
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  ASSERT_TRUE(Validate(*cloud).ok());
  ASSERT_EQ(cloud->size(), 4);
  EXPECT_EQ(cloud->sh_degree, 2);
  EXPECT_EQ(cloud->means[3], 2);
  // The first point's three neighbours are 2 away; the others have one at 2 and two at √8.
  EXPECT_NEAR(cloud->log_scales[0], std::log(2.0), 1e-6);
  EXPECT_NEAR(cloud->log_scales[5], std::log(std::sqrt((4 + 8 + 8) / 3.0)), 1e-6);
  for (const float logit : cloud->opacity_logits) EXPECT_NEAR(1 / (1 + std::exp(-logit)), 0.1, 1e-6);
  for (size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(cloud->sh[c] * kSh0 + 0.5, 0.5 * static_cast<double>(c), 1e-6);
    for (size_t k = 1; k < 9; ++k) EXPECT_EQ(cloud->sh[3 * k + c], 0);
  }
  bool differ = false;
  for (size_t i = 0; i < 16; ++i) {
    EXPECT_GE(cloud->quats[i], 0);
    EXPECT_LT(cloud->quats[i], 1);
    differ |= cloud->quats[i] != cloud->quats[0];
  }
  EXPECT_TRUE(differ);
  ExpectSameCloud(*InitialCloud(Corners(), 1, {.sh_degree = 2, .seed = 3}), *cloud);
  EXPECT_NE(InitialCloud(Corners(), 1, {.sh_degree = 2, .seed = 4})->quats, cloud->quats);
}

TEST(InitialCloud, CoincidingPointsHaveASize) {
  InitialPoints points;
  points.positions.assign(3 * 5, 1.0f);
  points.colors.assign(3 * 5, 0.5f);
  const auto cloud = InitialCloud(points, 2, {});
  ASSERT_TRUE(cloud.ok());
  for (const float s : cloud->log_scales) EXPECT_NEAR(s, std::log(2e-4), 1e-5);
}

TEST(InitialCloud, RefusesWhatIsNoStart) {
  EXPECT_EQ(InitialCloud(InitialPoints{}, 1, {}).error().code, ErrorCode::kBadArgument);
  InitialPoints points = Corners();
  points.positions[4] = NAN;
  EXPECT_FALSE(InitialCloud(points, 1, {}).ok());
  points = Corners();
  points.colors.pop_back();
  EXPECT_FALSE(InitialCloud(points, 1, {}).ok());
  EXPECT_FALSE(InitialCloud(Corners(), 1, {.opacity = 1}).ok());
  EXPECT_FALSE(InitialCloud(Corners(), 1, {.scale = 0}).ok());
  EXPECT_FALSE(InitialCloud(Corners(), 1, {.sh_degree = 4}).ok());
}

TEST(RandomPoints, FillTheCube) {
  const InitialPoints points = RandomPoints(10000, 0.5, 7);
  ASSERT_EQ(points.size(), 10000);
  double sum = 0;
  for (const float x : points.positions) {
    EXPECT_LE(std::abs(x), 1.5);
    sum += x * x;
  }
  EXPECT_NEAR(sum / 30000, 1.5 * 1.5 / 3, 0.03);
  for (const float c : points.colors) ASSERT_TRUE(c >= 0 && c < 1);
  EXPECT_EQ(RandomPoints(10000, 0.5, 7).positions, points.positions);
  EXPECT_NE(RandomPoints(10000, 0.5, 8).positions, points.positions);
  const InitialPoints small = RandomPoints(10000, 0.5, 7, 0.3);
  for (size_t i = 0; i < small.positions.size(); ++i) ASSERT_NEAR(small.positions[i], 0.1f * points.positions[i], 1e-6);
}

TEST(RandomPoints, InViewLieWhereTheCamerasLook) {
  const auto set = OrbitCameras(40, 2, {5, 6, 7}, PinholeFromFov(64, 48, std::numbers::pi / 4)).value();
  const double scale = 2.2;
  const InitialPoints points = RandomPointsInView(500, set.cameras, scale, 7);
  ASSERT_EQ(points.size(), 500);
  for (size_t i = 0; i < 1500; i += 3) {
    const auto x = points.positions[i], y = points.positions[i + 1], z = points.positions[i + 2];
    ASSERT_LT(std::hypot(x - 5, y - 6, z - 7), 1.5) << "what half of the cameras see of an orbit is near its middle";
  }
  // A camera that looks away from everything sees nothing of the cube that is near enough.
  Camera blind = set.cameras[0];
  blind.intrinsics.cx = 1e9;
  EXPECT_EQ(RandomPointsInView(50, {blind}, scale, 7).positions, RandomPoints(50, scale, 7).positions);
}

TEST(Points, OfStructureFromMotion) {
  const std::vector<ColmapPoint> model = {{{1, 2, 3}, {255, 0, 51}}, {{1e300, 0, 0}, {1, 1, 1}}};
  const InitialPoints points = PointsOf(model);
  EXPECT_EQ(points.positions, (Buffer<float>{1, 2, 3}));
  EXPECT_EQ(points.colors, (Buffer<float>{1, 0, 0.2f}));
}

TEST(Points, OfASplatAndThinned) {
  GaussianCloud cloud = RandomCloud(10, 1, 3);
  cloud.means[3] = NAN;
  const InitialPoints points = PointsOf(cloud);
  ASSERT_EQ(points.size(), 9);
  EXPECT_EQ(points.positions[3], cloud.means[6]);
  for (const float c : points.colors) EXPECT_TRUE(c >= 0 && c <= 1);
  const InitialPoints three = SubsampleEvenly(points, 3);
  ASSERT_EQ(three.size(), 3);
  EXPECT_EQ(three.positions[3], points.positions[9]);
  EXPECT_EQ(three.colors[8], points.colors[20]);
  EXPECT_EQ(SubsampleEvenly(points, 100).positions, points.positions);
}

}  // namespace
}  // namespace anchorsplat
