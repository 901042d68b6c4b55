#include "fit/fitter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "fit/fit.h"
#include "fit/initial_cloud.h"
#include "fit/orbit_scene_for_test.h"
#include "fit/small_fits_for_test.h"
#include "formats/random_cloud_for_test.h"
#include "images/image_io.h"
#include "io/folder_for_test.h"
#include "metrics/image_metrics.h"

namespace anchorsplat {
namespace {

using testing::HasSubstr;

class Fits : public SmallFits {
 protected:
  Fits() : SmallFits(24) {}
};

void ExpectSameState(const FitState& a, const FitState& b) {
  EXPECT_EQ(a.step, b.step);
  EXPECT_EQ(a.optimizer.steps(), b.optimizer.steps());
  ExpectSameCloud(a.cloud, b.cloud);
  for (size_t k = 0; k < a.optimizer.moments().size(); ++k) {
    EXPECT_TRUE(SameBits(a.optimizer.moments()[k].first, b.optimizer.moments()[k].first)) << k;
    EXPECT_TRUE(SameBits(a.optimizer.moments()[k].second, b.optimizer.moments()[k].second)) << k;
  }
  EXPECT_TRUE(SameBits(a.densification.gathered().grad2d, b.densification.gathered().grad2d));
  EXPECT_TRUE(SameBits(a.densification.gathered().count, b.densification.gathered().count));
  EXPECT_TRUE(SameBits(a.densification.gathered().radii, b.densification.gathered().radii));
}

TEST_F(Fits, GoingOnFromACheckpointGivesTheSameBits) {
  Fitter whole = Begin(Fitter::Fresh(Initial()));
  const auto path = folder_ / "state";
  while (!whole.done()) {
    ASSERT_TRUE(whole.Step().ok());
    // In the middle of an epoch, between two growths, with gradients gathered.
    if (whole.state().step != 27) continue;
    ASSERT_TRUE(WriteFitCheckpoint(path, whole.state(), "{}").ok());
  }
  ASSERT_NE(whole.state().cloud.size(), 60) << "the test is about changing rows";
  auto state = ReadFitCheckpoint(path, "{}");
  ASSERT_TRUE(state.ok()) << state.error().message;
  Fitter rest = Begin(*std::move(state));
  while (!rest.done()) ASSERT_TRUE(rest.Step().ok());
  ExpectSameState(rest.state(), whole.state());
}

TEST_F(Fits, SameBitsForAnyNumberOfThreads) {
  FitState expected;
  for (const int threads : {1, 2, 5}) {
    SetThreadCount(threads);
    Fitter fitter = Begin(Fitter::Fresh(Initial()));
    while (!fitter.done()) ASSERT_TRUE(fitter.Step().ok());
    if (threads == 1) expected = fitter.state();
    ExpectSameState(fitter.state(), expected);
  }
  SetThreadCount(0);
}

TEST_F(Fits, SeedsDiffer) {
  Fitter a = Begin(Fitter::Fresh(Initial()));
  options_.seed = 4;
  Fitter b = Begin(Fitter::Fresh(Initial()));
  std::vector<int64_t> views_a, views_b;
  for (int i = 0; i < 8; ++i) {
    views_a.push_back(a.Step()->view);
    views_b.push_back(b.Step()->view);
  }
  EXPECT_NE(views_a, views_b);
}

TEST_F(Fits, LearnsAKnownSplat) {
  options_ = FitOptionsFor(300);
  const auto fitted = Fit(views_, Initial(), options_);
  ASSERT_TRUE(fitted.ok()) << fitted.error().message;
  const FitReport& report = fitted->report;
  EXPECT_EQ(report.steps, 300);
  EXPECT_EQ(report.train.views, 8);
  EXPECT_EQ(report.held_out.views, 2);
  EXPECT_EQ(report.gaussians_in, 60);
  EXPECT_EQ(report.gaussians_out, fitted->cloud.size());
  EXPECT_EQ(fitted->cloud.render_mode, RenderMode::kClassic);
  EXPECT_GT(report.train.psnr, 25);
  EXPECT_GT(report.held_out.psnr, 20);
}

TEST_F(Fits, MapsAreFittedAsWellAsWhatLiesAtZero) {
  const std::array<double, 3> place = {500000, 4500000, 120};
  const TestFolder folder;
  CameraSet set = orbit_scene::Write(folder.path(), orbit_scene::Ball(150, 5), 12, 32);
  const auto psnr = [&] {
    const auto views = OpenProject(folder.path(), {.hold_out = 0});
    EXPECT_TRUE(views.ok());
    InitialPoints points = RandomPointsInView(200, views->train, views->scene_scale, 1);
    const auto fitted = Fit(*views, InitialCloud(points, views->scene_scale, {}).value(), FitOptionsFor(150));
    EXPECT_TRUE(fitted.ok()) << fitted.error().message;
    EXPECT_EQ(fitted->cloud.origin, views->origin);
    // The result is seen by cameras of the world.
    Rasterizer rasterizer;
    RenderOutput output;
    double sum = 0;
    for (const Camera& camera : set.cameras) {
      EXPECT_TRUE(rasterizer.Render(fitted->cloud, camera, {}, output).ok());
      const auto truth = ReadImage(folder / (camera.name + ".png"));
      Clamp01(output.color);
      sum += Psnr(output.color, *truth).value() / static_cast<double>(set.cameras.size());
    }
    EXPECT_NEAR(sum, fitted->report.train.psnr, 0.1);
    return sum;
  };
  const double at_zero = psnr();
  for (Camera& camera : set.cameras) camera = RelativeToOrigin(camera, {-place[0], -place[1], -place[2]});
  ASSERT_TRUE(WriteTransforms(folder / "transforms.json", set, {.overwrite = true}).ok());
  EXPECT_NEAR(psnr(), at_zero, 0.5);
}

TEST_F(Fits, WhatCannotBeginDoesNot) {
  const auto begin = [&](PictureCache pictures, GaussianCloud cloud) {
    return Fitter::Begin(options_, std::move(pictures), 1, Fitter::Fresh(std::move(cloud)));
  };
  EXPECT_EQ(begin(PictureCache({}, {0, 0, 0}), Initial()).error().code, ErrorCode::kBadArgument);
  EXPECT_EQ(begin(PictureCache(views_.train, {0, 0, 0}), {}).error().code, ErrorCode::kBadArgument);
  options_.steps = 0;
  EXPECT_EQ(begin(PictureCache(views_.train, {0, 0, 0}), Initial()).error().code, ErrorCode::kBadArgument);
}

TEST_F(Fits, NothingLeftIsAnError) {
  options_.densification.prune_opa = 0.4;
  const auto fitted = Fit(views_, Initial(), options_);
  ASSERT_FALSE(fitted.ok());
  EXPECT_THAT(fitted.error().message, HasSubstr("removed every Gaussian"));
}

TEST(FitOptions, NumbersAreFinite) {
  for (const double wrong : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), -1.0}) {
    for (double DensificationOptions::*const member :
         {&DensificationOptions::grow_grad2d, &DensificationOptions::grow_scale3d, &DensificationOptions::grow_scale2d,
          &DensificationOptions::prune_scale3d, &DensificationOptions::prune_scale2d}) {
      FitOptions options;
      ASSERT_TRUE(Validate(options).ok());
      options.densification.*member = wrong;
      EXPECT_FALSE(Validate(options).ok()) << wrong;
    }
    FitOptions options;
    options.objective.loss.ssim_weight = wrong;
    EXPECT_FALSE(Validate(options).ok()) << wrong;
  }
}

TEST(FitOptions, ScheduleOfTheDefault) {
  const FitOptions options = FitOptionsFor();
  EXPECT_EQ(options.steps, 15000);
  EXPECT_EQ(ShDegreeAt(options, 499), 0);
  EXPECT_EQ(ShDegreeAt(options, 500), 1);
  EXPECT_EQ(ShDegreeAt(options, 14999), 3);
  EXPECT_EQ(options.densification.reset_every, 1500);
  EXPECT_NEAR(MeansRate(options.rates, 2, 0, 15000), 3.2e-4, 1e-12);
  EXPECT_NEAR(MeansRate(options.rates, 2, 7500, 15000), 3.2e-5, 1e-12);
  EXPECT_NEAR(MeansRate(options.rates, 2, 15000, 15000), 3.2e-6, 1e-12);
}

}  // namespace
}  // namespace anchorsplat
