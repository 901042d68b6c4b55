#include "core/world_origin.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/random.h"

namespace anchorsplat {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Within `reach` of `center`.
std::vector<double> PointsAround(const std::array<double, 3>& center, double reach) {
  Random random(1);
  std::vector<double> points;
  for (int i = 0; i < 300; ++i) points.push_back(center[static_cast<size_t>(i % 3)] + random.Uniform(-reach, reach));
  return points;
}

TEST(WorldOrigin, IsZeroWhereFloatsAreFineEnough) {
  EXPECT_EQ(ChooseOrigin(PointsAround({3, -20, 40}, 5), 0.05), WorldOrigin{});
  EXPECT_EQ(ChooseOrigin(PointsAround({500000, 4500000, 120}, 5), 1000), WorldOrigin{}) << "all is a kilometre long";
  EXPECT_EQ(ChooseOrigin({}, 1), WorldOrigin{});
  EXPECT_EQ(ChooseOrigin(PointsAround({1e9, 0, 0}, 1), 0), WorldOrigin{}) << "nothing says what matters";
}

TEST(WorldOrigin, LiesInRoundNumbersNearTheMiddle) {
  const WorldOrigin origin = ChooseOrigin(PointsAround({500012, 4500017, 120}, 5), 0.05);
  EXPECT_EQ(origin, (WorldOrigin{500000, 4500000, 0}));
  // What floats have left then is a 256th of what matters at most.
  for (const double x : PointsAround({12, 17, 120}, 5)) {
    const auto f = static_cast<float>(x);
    EXPECT_LT(std::nextafter(f, 1e9f) - f, 0.05 / 256);
  }
}

TEST(WorldOrigin, IsZeroWhereNobodyCouldReadIt) {
  for (const double x : {2e15, 1e20, 1e39, 1e300}) {
    EXPECT_TRUE(IsZero(ChooseOrigin(std::vector<double>{x, 0, 0, x, 1, 0}, 0.01))) << x;
  }
  EXPECT_FALSE(IsZero(ChooseOrigin(std::vector<double>{9e14, 0, 0, 9e14, 1, 0}, 0.01)));
}

TEST(WorldOrigin, DoesNotMindStraysAndWhatIsNoNumber) {
  std::vector<double> points = PointsAround({500012, 4500017, 120}, 5);
  for (const double x : {1e30, -1e30, 1e30, std::nan(""), 0.0, kInfinity}) points.push_back(x);
  EXPECT_EQ(ChooseOrigin(points, 0.05), (WorldOrigin{500000, 4500000, 0}));
  const std::vector<double> none = {std::nan(""), 1, 2};
  EXPECT_EQ(ChooseOrigin(none, 0.05), WorldOrigin{});
}

TEST(WorldOrigin, OfCamerasComesFromTheirSpread) {
  const auto orbit = OrbitCameras(12, 3, {500000, 80000, 20}, PinholeFromFov(64, 64, 1));
  ASSERT_TRUE(orbit.ok());
  const WorldOrigin origin = ChooseOrigin(orbit->cameras);
  EXPECT_NEAR(origin[0], 500000, 100);
  EXPECT_NEAR(origin[1], 80000, 100);
  EXPECT_EQ(ChooseOrigin(OrbitCameras(12, 3, {5, 80, 20}, PinholeFromFov(64, 64, 1))->cameras), WorldOrigin{});
  EXPECT_EQ(ChooseOrigin(std::vector<Camera>(1)), WorldOrigin{}) << "one camera says nothing";
}

TEST(WorldOrigin, TextReadsBackTheSame) {
  const WorldOrigin origin = {500000.125, -4.5e6, 1.0 / 3};
  EXPECT_EQ(OriginOfComment(OriginComment(origin)), origin);
  EXPECT_EQ(OriginComment({500000, 4500000, 120}), "SplatOrigin: 500000 4500000 120");
  for (const char* broken : {"SplatOrigin: 1 2", "SplatOrigin: 1 2 nan", "SplatOrigin: 1 2 3 4", "Origin: 1 2 3"}) {
    EXPECT_FALSE(OriginOfComment(broken)) << broken;
  }
  std::vector<std::string> comments = {"made by me", "SplatOrigin: 1 2 3", "SplatOrigin: 4 5 6"};
  EXPECT_EQ(TakeOrigin(comments), (WorldOrigin{4, 5, 6}));
  EXPECT_EQ(comments, std::vector<std::string>{"made by me"});
}

TEST(WorldOrigin, CamerasSeeTheSameFromIt) {
  const auto orbit = OrbitCameras(5, 3, {500000, 4500000, 120}, PinholeFromFov(64, 64, 1));
  const WorldOrigin origin = {500000, 4500000, 100};
  for (const Camera& camera : orbit->cameras) {
    const auto in_world = camera.ToCamera({500001, 4499999, 121});
    const auto from_origin = RelativeToOrigin(camera, origin).ToCamera({1, -1, 21});
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(in_world[k], from_origin[k], 1e-8);
  }
}

TEST(WorldOrigin, AppendedGaussiansStayWhereTheyAre) {
  GaussianCloud one, other;
  one.Resize(1, 0);
  other.Resize(1, 0);
  one.origin = {500000, 0, 0};
  other.origin = {500010, 0, -7};
  one.means = {1, 2, 3};
  other.means = {4, 5, 6};
  ASSERT_TRUE(Append(one, other).ok());
  EXPECT_EQ(one.origin, (WorldOrigin{500000, 0, 0}));
  EXPECT_EQ(one.means, (Buffer<float>{1, 2, 3, 14, 5, -1}));
}

}  // namespace
}  // namespace anchorsplat
