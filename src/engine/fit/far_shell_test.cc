#include "fit/far_shell.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>

#include "core/parallel.h"
#include "core/random.h"
#include "core/run_context.h"
#include "core/spherical_harmonics.h"
#include "fit/fit.h"
#include "formats/random_cloud_for_test.h"
#include "images/image_io.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

using ::testing::HasSubstr;
using Triple = std::array<double, 3>;

constexpr int kPictureSide = 64;  // pixels of all pictures

// A smooth colour for every direction.
Triple SkyAt(const Triple& d) { return {0.5 + 0.4 * d[0], 0.5 + 0.3 * d[1], 0.5 - 0.4 * d[2]}; }
Triple GreyAt(const Triple&) { return {0.6, 0.6, 0.6}; }

// Where the ray through a pixel's centre goes, world.
Triple DirectionOf(const Camera& camera, int x, int y) {
  const Pinhole& k = camera.intrinsics;
  const Triple c = {(x + 0.5 - k.cx) / k.fx, (y + 0.5 - k.cy) / k.fy, 1};
  const auto& r = camera.world_to_camera.rotation;
  const double length = std::hypot(c[0], c[1], c[2]);
  Triple d{};
  for (size_t k3 = 0; k3 < 3; ++k3) d[k3] = (r[k3] * c[0] + r[3 + k3] * c[1] + r[6 + k3] * c[2]) / length;
  return d;
}

class FarShells : public testing::Test {
 protected:
  // Views whose pictures show what is infinitely far away. `alpha`: of all pixels but those in the middle; 1: none.
  TrainingViews Views(std::vector<Camera> cameras, const std::function<Triple(const Triple&)>& sky, double alpha = 1) {
    TrainingViews views;
    for (size_t i = 0; i < cameras.size(); ++i) {
      Camera& camera = cameras[i];
      Image image(kPictureSide, kPictureSide, alpha < 1 ? 4 : 3);
      for (int y = 0; y < kPictureSide; ++y) {
        for (int x = 0; x < kPictureSide; ++x) {
          const Triple color = sky(DirectionOf(camera, x, y));
          for (int c = 0; c < 3; ++c) image.at(c, y, x) = static_cast<float>(color[static_cast<size_t>(c)]);
          const bool middle =
              std::max(std::abs(x - kPictureSide / 2), std::abs(y - kPictureSide / 2)) < kPictureSide / 8;
          if (alpha < 1) image.at(3, y, x) = middle ? 1 : static_cast<float>(alpha);
        }
      }
      camera.image = folder_ / (std::to_string(i) + ".png");
      EXPECT_TRUE(WritePng(camera.image, image, {.overwrite = true}).ok());
    }
    views.scene_scale = SceneScale(cameras);
    views.train = std::move(cameras);
    return views;
  }

  static std::vector<Camera> Orbit(int count = 12) {
    return OrbitCameras(count, 2, {1, 2, 3}, PinholeFromFov(kPictureSide, kPictureSide, std::numbers::pi / 3))
        .value()
        .cameras;
  }

  // Points in a ball around the middle of the orbit.
  static InitialPoints Ball(int64_t count, double radius, uint64_t seed = 5) {
    Random random(seed);
    InitialPoints points;
    while (points.size() < count) {
      Triple p{};
      for (double& x : p) x = random.Uniform(-1, 1);
      if (std::hypot(p[0], p[1], p[2]) > 1) continue;
      for (size_t k = 0; k < 3; ++k)
        points.positions.push_back(static_cast<float>(1.0 + static_cast<double>(k) + radius * p[k]));
      points.colors.insert(points.colors.end(), {0.5f, 0.5f, 0.5f});
    }
    return points;
  }

  TestFolder folder_;
};

TEST(FibonacciSphere, MatchesThePlainReferenceAndIsEven) {
  for (const int64_t n : {1, 2, 77, 1000}) {
    const auto places = FibonacciSphere(n);
    ASSERT_EQ(std::ssize(places), n);
    for (int64_t i = 0; i < n; ++i) {
      // By latitude and longitude: the golden ratio's share of a turn from one to the next, equal areas below it.
      const double polar = std::acos(1 - (2.0 * static_cast<double>(i) + 1) / static_cast<double>(n));
      const double turn = 2 * std::numbers::pi * (1 - 1 / std::numbers::phi) * static_cast<double>(i);
      const auto& p = places[static_cast<size_t>(i)];
      EXPECT_NEAR(p[0], std::sin(polar) * std::cos(turn), 1e-9) << n << " " << i;
      EXPECT_NEAR(p[1], std::cos(polar), 1e-12);
      EXPECT_NEAR(p[2], std::sin(polar) * std::sin(turn), 1e-9);
    }
  }
  const auto places = FibonacciSphere(1000);
  const double spacing = std::sqrt(4 * std::numbers::pi / 1000);
  for (const auto& a : places) {
    double nearest = 9;
    for (const auto& b : places) {
      const double d = std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
      if (d > 0) nearest = std::min(nearest, d);
    }
    EXPECT_GT(nearest, 0.6 * spacing);
    EXPECT_LT(nearest, 1.2 * spacing);
  }
  EXPECT_TRUE(FibonacciSphere(0).empty());
}

TEST_F(FarShells, StandWhereNoPointsAreWithTheColourOfThePictures) {
  const TrainingViews views = Views(Orbit(), SkyAt);
  const InitialPoints points = Ball(2000, 0.4);
  const auto shell = MakeFarShell(views, points, {.sh_degree = 1});
  ASSERT_TRUE(shell.ok()) << shell.error().message;
  EXPECT_GT(shell->open_share, 0.5);
  EXPECT_LT(shell->open_share, 0.9) << "the ball is in every picture";
  EXPECT_THAT(shell->why, HasSubstr("no points cover"));
  EXPECT_DOUBLE_EQ(shell->radius, 10 * views.scene_scale) << "the cameras are farther out than the points";
  EXPECT_DOUBLE_EQ(shell->units.radius, views.scene_scale);
  const GaussianCloud& cloud = shell->cloud;
  ASSERT_TRUE(Validate(cloud).ok());
  ASSERT_GT(cloud.size(), 100);
  ASSERT_LT(cloud.size(), shell->on_sphere);
  EXPECT_EQ(cloud.sh_degree, 1);
  const double spacing = shell->radius * std::sqrt(4 * std::numbers::pi / static_cast<double>(shell->on_sphere));
  for (size_t i = 0; i < static_cast<size_t>(cloud.size()); ++i) {
    const float* p = cloud.means.data() + 3 * i;
    const Triple from = {p[0] - shell->units.center[0], p[1] - shell->units.center[1], p[2] - shell->units.center[2]};
    ASSERT_NEAR(std::hypot(from[0], from[1], from[2]), shell->radius, 1e-4);
    EXPECT_NEAR(1 / (1 + std::exp(-cloud.opacity_logits[i])), kShellOpacity, 1e-6);
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(std::exp(cloud.log_scales[3 * i + k]), spacing, 1e-4 * spacing);
      // The cameras are 2 away from the middle of a sphere of radius 22: 5 degrees.
      EXPECT_NEAR(cloud.sh[12 * i + k] * kSh0 + 0.5,
                  SkyAt({from[0] / shell->radius, from[1] / shell->radius, from[2] / shell->radius})[k], 0.07);
    }
    for (size_t k = 3; k < 12; ++k) EXPECT_EQ(cloud.sh[12 * i + k], 0);
    bool shown = false;
    for (const Camera& camera : views.train) {
      const auto c = camera.ToCamera({p[0], p[1], p[2]});
      const Pinhole& k = camera.intrinsics;
      const double x = k.fx * c[0] / c[2] + k.cx, y = k.fy * c[1] / c[2] + k.cy;
      shown |= c[2] > 0 && x >= 0 && y >= 0 && x < k.width && y < k.height;
    }
    EXPECT_TRUE(shown);
  }
}

TEST_F(FarShells, AreNotMadeWherePointsAreEverywhere) {
  const TrainingViews views = Views(Orbit(), SkyAt);
  InitialPoints walls;
  for (const auto& d : FibonacciSphere(20000)) {
    for (size_t k = 0; k < 3; ++k)
      walls.positions.push_back(static_cast<float>(1.0 + static_cast<double>(k) + 4 * d[k]));
    walls.colors.insert(walls.colors.end(), {0, 0, 0});
  }
  const auto shell = MakeFarShell(views, walls, {});
  ASSERT_TRUE(shell.ok());
  EXPECT_TRUE(shell->cloud.empty());
  EXPECT_FALSE(shell->units.any());
  EXPECT_THAT(shell->why, HasSubstr("none, as points cover 100 %"));
  // Who asks gets one, beyond the walls.
  const auto asked = MakeFarShell(views, walls, {.count = 300});
  ASSERT_TRUE(asked.ok());
  EXPECT_GT(asked->cloud.size(), 100);
  EXPECT_NEAR(asked->radius, 40, 1) << "the cameras' mean is not quite the middle";
}

TEST_F(FarShells, AreNotMadeOfABackground) {
  const InitialPoints points = Ball(2000, 0.4);
  const auto plain = MakeFarShell(Views(Orbit(), GreyAt), points, {});
  ASSERT_TRUE(plain.ok());
  EXPECT_TRUE(plain->cloud.empty());
  EXPECT_THAT(plain->why, HasSubstr("a single colour"));
  const auto asked = MakeFarShell(Views(Orbit(), GreyAt), points, {.count = 500});
  ASSERT_FALSE(asked->cloud.empty());
  EXPECT_NEAR(asked->cloud.sh[0] * kSh0 + 0.5, 0.6, 0.003);

  const auto transparent = MakeFarShell(Views(Orbit(), SkyAt, 0), points, {});
  ASSERT_TRUE(transparent.ok());
  EXPECT_TRUE(transparent->cloud.empty());
  EXPECT_THAT(transparent->why, HasSubstr("masked or transparent"));

  TrainingViews masked = Views(Orbit(), SkyAt);
  Image mask(kPictureSide, kPictureSide, 1);
  std::fill(mask.pixels.begin(), mask.pixels.end(), 0.0f);
  mask.at(0, kPictureSide / 2, kPictureSide / 2) = 1;
  ASSERT_TRUE(WritePng(folder_ / "mask.png", mask).ok());
  for (Camera& camera : masked.train) camera.photograph.mask = folder_ / "mask.png";
  const auto hidden = MakeFarShell(masked, points, {});
  ASSERT_TRUE(hidden.ok()) << hidden.error().message;
  EXPECT_TRUE(hidden->cloud.empty());
  EXPECT_THAT(hidden->why, HasSubstr("masked or transparent"));
}

TEST_F(FarShells, DoAsTheyAreTold) {
  const TrainingViews views = Views(Orbit(), SkyAt);
  const InitialPoints points = Ball(2000, 0.4);
  EXPECT_TRUE(MakeFarShell(views, points, {.count = 0})->cloud.empty());
  EXPECT_TRUE(MakeFarShell(views, points, {.points_tell = false})->cloud.empty());
  EXPECT_FALSE(MakeFarShell(views, points, {.count = 200, .points_tell = false})->cloud.empty());
  EXPECT_EQ(MakeFarShell(views, points, {.count = 200})->on_sphere, 200);
  EXPECT_EQ(MakeFarShell(views, points, {.max_gaussians = 900})->on_sphere, 450);
  EXPECT_EQ(MakeFarShell(views, points, {.count = -1}).error().code, ErrorCode::kBadArgument);
  EXPECT_EQ(MakeFarShell(views, points, {.count = kMostOnShell + 1}).error().code, ErrorCode::kBadArgument);
  EXPECT_EQ(MakeFarShell(TrainingViews(), points, {}).error().code, ErrorCode::kBadArgument);
  TrainingViews lost = views;
  lost.train[3].image = folder_ / "gone.png";
  EXPECT_EQ(MakeFarShell(lost, points, {}).error().code, ErrorCode::kNotFound);
  TrainingViews smaller = views;
  smaller.train[3].intrinsics.width = 32;
  EXPECT_EQ(MakeFarShell(smaller, points, {}).error().code, ErrorCode::kBadFile);
}

TEST_F(FarShells, TakeWhatThereIs) {
  const TrainingViews views = Views(Orbit(), SkyAt);
  const auto no_points = MakeFarShell(views, InitialPoints(), {});
  ASSERT_TRUE(no_points.ok());
  EXPECT_DOUBLE_EQ(no_points->open_share, 1);
  EXPECT_FALSE(no_points->cloud.empty());

  // Neither places nor colours of points need be numbers, and one that is lost does not push the sphere away.
  InitialPoints odd = Ball(2000, 0.4);
  std::fill(odd.colors.begin(), odd.colors.end(), NAN);
  for (size_t k = 0; k < 30; ++k) odd.positions[k] = k % 2 == 0 ? NAN : 1e30f;
  const auto shell = MakeFarShell(views, odd, {});
  ASSERT_TRUE(shell.ok());
  EXPECT_DOUBLE_EQ(shell->radius, 10 * views.scene_scale);
  for (const float x : shell->cloud.sh) ASSERT_TRUE(std::isfinite(x));

  const auto one = MakeFarShell(Views(Orbit(1), SkyAt), Ball(50, 0.2), {});
  ASSERT_TRUE(one.ok());
  EXPECT_FALSE(one->cloud.empty());
  EXPECT_GE(one->radius, 10);

  std::vector<Camera> turning = Orbit(6);
  for (Camera& camera : turning) camera.world_to_camera.translation = {0, 0, 0};
  const auto place = MakeFarShell(Views(turning, SkyAt), InitialPoints(), {});
  ASSERT_TRUE(place.ok());
  EXPECT_NEAR(place->radius, 10, 1e-9) << "the scene scale of cameras in one place is 1";

  InitialPoints huge = Ball(50, 1);
  for (float& x : huge.positions) x *= 1e37f;
  const auto too_far = MakeFarShell(views, huge, {.count = 100});
  ASSERT_TRUE(too_far.ok());
  EXPECT_TRUE(too_far->cloud.empty());
  EXPECT_THAT(too_far->why, HasSubstr("too far"));
}

TEST_F(FarShells, PointsBehindACameraCoverNothing) {
  Camera camera = Orbit(1)[0];
  const TrainingViews views = Views({camera}, SkyAt);
  InitialPoints points;
  const auto center = camera.Center();
  const auto& r = camera.world_to_camera.rotation;
  for (int i = 0; i < 500; ++i) {
    for (size_t k = 0; k < 3; ++k)
      points.positions.push_back(static_cast<float>(center[k] - (1 + 0.01 * i) * r[6 + k]));
    points.colors.insert(points.colors.end(), {0, 0, 0});
  }
  EXPECT_DOUBLE_EQ(MakeFarShell(views, points, {})->open_share, 1);
}

TEST_F(FarShells, ForegroundDoesNotColourThem) {
  // What lies before the points' ball is red in all pictures; the sky beside it keeps its colour.
  const TrainingViews views = Views(Orbit(40), SkyAt);
  for (const Camera& camera : views.train) {
    Image image(kPictureSide, kPictureSide, 3);
    for (int y = 0; y < kPictureSide; ++y) {
      for (int x = 0; x < kPictureSide; ++x) {
        const Triple sky = SkyAt(DirectionOf(camera, x, y));
        const bool ball = std::hypot(x + 0.5 - kPictureSide / 2, y + 0.5 - kPictureSide / 2) < 0.21 * kPictureSide;
        for (int c = 0; c < 3; ++c)
          image.at(c, y, x) = ball ? (c == 0 ? 1.0f : 0.0f) : static_cast<float>(sky[static_cast<size_t>(c)]);
      }
    }
    ASSERT_TRUE(WritePng(camera.image, image, {.overwrite = true}).ok());
  }
  const auto shell = MakeFarShell(views, Ball(4000, 0.45), {});
  ASSERT_TRUE(shell.ok());
  int64_t red = 0;
  for (size_t i = 0; i < static_cast<size_t>(shell->cloud.size()); ++i) {
    const float* sh = shell->cloud.sh.data() + static_cast<size_t>(shell->cloud.sh_stride()) * i;
    red += sh[1] * kSh0 + 0.5f < 0.1f ? 1 : 0;
  }
  EXPECT_LT(static_cast<double>(red), 0.02 * static_cast<double>(shell->cloud.size()));
}

TEST_F(FarShells, TheSameBitsForAnyNumberOfThreads) {
  const TrainingViews views = Views(Orbit(), SkyAt);
  const InitialPoints points = Ball(2000, 0.4);
  GaussianCloud expected;
  for (const int threads : {1, 2, 5}) {
    SetThreadCount(threads);
    const auto shell = MakeFarShell(views, points, {});
    ASSERT_TRUE(shell.ok());
    if (threads == 1) expected = shell->cloud;
    ExpectSameCloud(shell->cloud, expected);
  }
  SetThreadCount(0);
}

TEST_F(FarShells, AreAddedBehindTheOthersAndToldToTheOptions) {
  const TrainingViews views = Views(Orbit(), SkyAt);
  const InitialPoints points = Ball(200, 0.4);
  FitOptions options = FitOptionsFor(100);
  const std::string before = ToJsonText(options);
  const GaussianCloud start = InitialCloud(points, views.scene_scale, StartOptions(options)).value();
  GaussianCloud cloud = start;
  ASSERT_TRUE(AddFarShell(views, points, 0, true, options, cloud).ok());
  ExpectSameCloud(cloud, start);
  EXPECT_EQ(ToJsonText(options), before) << "a fit without a shell is the one it was";

  const auto added = AddFarShell(views, points, std::nullopt, true, options, cloud);
  ASSERT_TRUE(added.ok()) << added.error().message;
  ASSERT_GT(added->gaussians, 0);
  ASSERT_EQ(cloud.size(), start.size() + added->gaussians);
  std::vector<int64_t> first;
  for (int64_t i = 0; i < start.size(); ++i) first.push_back(i);
  ExpectSameCloud(Subset(cloud, first).value(), start);
  EXPECT_DOUBLE_EQ(options.far.radius, views.scene_scale);
  EXPECT_NE(ToJsonText(options), before);
  EXPECT_TRUE(Validate(options).ok());
  options.far.radius = -1;
  EXPECT_FALSE(Validate(options).ok());
}

TEST_F(FarShells, AFitGoesOnWithItsOwnOnly) {
  const TrainingViews views = Views(Orbit(), SkyAt);
  const InitialPoints points = Ball(200, 0.4);
  std::atomic<bool> stop{false};
  const RunScope run({.stop = &stop});
  const auto fit = [&](std::optional<int64_t> count, bool resume, int64_t stop_at) {
    FitOptions options = FitOptionsFor(20);
    GaussianCloud cloud = InitialCloud(points, views.scene_scale, StartOptions(options)).value();
    EXPECT_TRUE(AddFarShell(views, points, count, true, options, cloud).ok());
    FitControl control;
    control.checkpoint = folder_ / "state";
    control.resume = resume;
    control.observe = [&](const Fitter& fitter) { stop = fitter.step() >= stop_at; };
    stop = false;
    return Fit(views, std::move(cloud), options, control);
  };
  ASSERT_TRUE(fit(300, false, 9)->report.interrupted);
  for (const int64_t other : {0, 200}) {
    const auto refused = fit(other, true, 99);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::kBadArgument);
    EXPECT_THAT(refused.error().message, HasSubstr("its start differs"));
  }
  const auto whole = fit(300, true, 99);
  ASSERT_TRUE(whole.ok()) << whole.error().message;
  EXPECT_EQ(whole->report.resumed_at, 9);
  std::filesystem::remove(folder_ / "state");
  ExpectSameCloud(fit(300, false, 99)->cloud, whole->cloud);

  ASSERT_TRUE(fit(0, false, 9)->report.interrupted);
  const auto refused = fit(300, true, 99);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("its start differs"));
}

}  // namespace
}  // namespace anchorsplat
