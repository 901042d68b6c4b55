#include "fit/resident_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <memory>
#include <utility>

#include "core/messages_for_test.h"
#include "fit/fit.h"
#include "fit/fitter.h"
#include "fit/initial_cloud.h"
#include "fit/orbit_scene_for_test.h"
#include "fit/run_on_gpu_for_test.h"
#include "fit/small_fits_for_test.h"
#include "formats/random_cloud_for_test.h"
#include "gpu/faulty_device_for_test.h"
#include "gpu/gpu_for_test.h"
#include "images/image_io.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr int kSide = 32;
constexpr double kAlike = 0.1;  // dB

class ResidentFits : public SmallFits {
 protected:
  ResidentFits() : SmallFits(kSide) {}

  void SetUp() override {
    device_ = GpuForTest();
    ASSERT_NE(device_, nullptr);
    SmallFits::SetUp();
  }

  Fitted OnGpu(std::shared_ptr<GpuDevice> device, const FitControl& control = {}) const {
    const RunOnGpu run(std::move(device));
    return Fit(views_, Initial(), options_, control).value();
  }
  // What the GPU comes to, which is what the CPU comes to.
  Fitted ExpectAlike() const {
    const Fitted here = Fit(views_, Initial(), options_).value();
    const Messages messages;
    Fitted there = OnGpu(device_);
    EXPECT_THAT(messages.warnings(), IsEmpty());
    EXPECT_NEAR(there.report.train.psnr, here.report.train.psnr, kAlike);
    EXPECT_NEAR(there.report.held_out.psnr, here.report.held_out.psnr, 3 * kAlike);
    EXPECT_NEAR(there.report.loss, here.report.loss, 0.05 * here.report.loss);
    return there;
  }

  std::shared_ptr<GpuDevice> device_;
};

double LargestDifference(const Buffer<float>& a, const Buffer<float>& b) {
  EXPECT_EQ(a.size(), b.size());
  double most = 0;
  for (size_t i = 0; i < std::min(a.size(), b.size()); ++i) most = std::max(most, std::abs(double{a[i]} - b[i]));
  return most;
}

TEST_F(ResidentFits, BeginAsTheCpuDoes) {
  options_.densification.refine_start_iter = 100;
  Fitter here = Begin(Fitter::Fresh(Initial()));
  const RunOnGpu run(device_);
  Fitter there = Begin(Fitter::Fresh(Initial()));
  for (int step = 0; step < 3; ++step) {
    ASSERT_TRUE(here.Step().ok());
    ASSERT_TRUE(there.Step().ok());
    EXPECT_NEAR(there.LastPsnr(), here.LastPsnr(), 0.01);
    EXPECT_NEAR(there.LastLoss(), here.LastLoss(), 1e-3 * here.LastLoss());
  }
  const FitState &a = here.state(), &b = there.state();
  EXPECT_EQ(a.step, b.step);
  EXPECT_EQ(a.optimizer.steps(), b.optimizer.steps());
  // Steps of Adam are as long as the rates, whatever the gradient: a few that are nearly 0 go the other way.
  EXPECT_LT(LargestDifference(a.cloud.sh, b.cloud.sh), 2e-3);
  EXPECT_LT(LargestDifference(a.cloud.means, b.cloud.means), 1e-3);
  EXPECT_LT(LargestDifference(a.densification.gathered().grad2d, b.densification.gathered().grad2d), 1e-4);
  EXPECT_EQ(LargestDifference(a.densification.gathered().count, b.densification.gathered().count), 0);
  EXPECT_LT(LargestDifference(a.densification.gathered().radii, b.densification.gathered().radii), 1e-6);
}

TEST_F(ResidentFits, ComeToWhatTheCpuComesTo) {
  const Fitted there = ExpectAlike(), again = OnGpu(device_);
  ExpectSameCloud(again.cloud, there.cloud);
  EXPECT_EQ(again.report.loss, there.report.loss);
}

TEST_F(ResidentFits, HaveSphericalHarmonicsAndTheirDegrees) {
  options_.sh_degree_interval = 20;
  ExpectAlike();
}

TEST_F(ResidentFits, TakeAreasOfPixels) {
  options_.pixel.upscale = 2;
  ExpectAlike();
}

TEST_F(ResidentFits, TakeOutExposures) {
  options_.exposure_from = 10;
  options_.densification.refine_start_iter = 100;  // growing amplifies rounding errors
  ExpectAlike();
}

TEST_F(ResidentFits, CutABeginningThatWasTooLarge) {
  options_.densification.max_gaussians = 50;
  options_.densification.refine_stop_iter = 12;
  options_.densification.absgrad = true;
  options_.densification.revised_opacity = true;
  EXPECT_LE(ExpectAlike().cloud.size(), 50);
}

TEST_F(ResidentFits, WhatIsNotForTheGpuIsDoneHere) {
  options_.regularizers.opacity_reg = 0.01;
  options_.densification.refine_start_iter = 100;
  const Fitted here = Fit(views_, Initial(), options_).value();
  EXPECT_NEAR(OnGpu(device_).report.train.psnr, here.report.train.psnr, kAlike);
}

TEST_F(ResidentFits, CheckpointsGoFromOneDeviceToAnother) {
  const auto path = folder_ / "state";
  FitState whole;
  {
    const RunOnGpu run(device_);
    Fitter fitter = Begin(Fitter::Fresh(Initial()));
    while (!fitter.done()) {
      ASSERT_TRUE(fitter.Step().ok());
      // In the middle of an epoch, between two growths, with gradients gathered.
      if (fitter.step() != 27) continue;
      ASSERT_TRUE(WriteFitCheckpoint(path, fitter.state(), "{}").ok());
    }
    whole = fitter.state();
  }
  {
    const RunOnGpu run(device_);
    Fitter rest = Begin(ReadFitCheckpoint(path, "{}").value());
    while (!rest.done()) ASSERT_TRUE(rest.Step().ok());
    ExpectSameCloud(rest.state().cloud, whole.cloud);
  }
  const double expected = Fit(views_, Initial(), options_).value().report.train.psnr;
  const auto psnr_of = [&](const GaussianCloud& cloud) {
    PictureCache pictures(views_.train, {0, 0, 0});
    return MeasureQuality(cloud, options_.objective.render, pictures).value().psnr;
  };
  Fitter here = Begin(ReadFitCheckpoint(path, "{}").value());
  while (!here.done()) ASSERT_TRUE(here.Step().ok());
  EXPECT_NEAR(psnr_of(here.UsableCloud()), expected, kAlike);

  Fitter first = Begin(Fitter::Fresh(Initial()));
  while (first.step() < 27) ASSERT_TRUE(first.Step().ok());
  ASSERT_TRUE(WriteFitCheckpoint(path, first.state(), "{}").ok());
  const RunOnGpu run(device_);
  Fitter second = Begin(ReadFitCheckpoint(path, "{}").value());
  while (!second.done()) ASSERT_TRUE(second.Step().ok());
  EXPECT_NEAR(psnr_of(second.UsableCloud()), expected, kAlike);
}

TEST_F(ResidentFits, InterruptionsLoseNothing) {
  const Fitted whole = OnGpu(device_);
  std::atomic<bool> stop{false};
  FitControl control;
  control.checkpoint = folder_ / "state";
  control.observe = [&](const Fitter& fitter) { stop = fitter.step() >= 31; };
  {
    const RunOnGpu run(device_, &stop);
    const auto first = Fit(views_, Initial(), options_, control);
    ASSERT_TRUE(first.ok());
    EXPECT_TRUE(first->report.interrupted);
    EXPECT_EQ(first->report.steps, 31);
    EXPECT_EQ(first->report.kept_step, 31);
  }
  control.observe = nullptr;
  control.resume = true;
  const Fitted second = OnGpu(device_, control);
  EXPECT_EQ(second.report.resumed_at, 31);
  ExpectSameCloud(second.cloud, whole.cloud);
}

TEST_F(ResidentFits, ALostDeviceCostsSteps) {
  const auto counting = std::make_shared<FaultyDevice>(device_, GpuFaults{});
  const double expected = OnGpu(counting).report.train.psnr;
  FitControl control;
  control.checkpoint = folder_ / "state";
  control.checkpoint_every = 25;
  for (const double part : {0.001, 0.7, 0.99}) {
    const Messages messages;
    const auto faulty = std::make_shared<FaultyDevice>(
        device_, GpuFaults{.calls = static_cast<int>(part * static_cast<double>(counting->calls()))});
    const Fitted fitted = OnGpu(faulty, control);
    EXPECT_EQ(fitted.report.steps, 60);
    EXPECT_NEAR(fitted.report.train.psnr, expected, kAlike) << part;
    EXPECT_THAT(messages.warnings(), Contains(HasSubstr("as the GPU failed: the device was lost (a test says so)")));
    if (part > 0.5 && part < 0.9) {
      EXPECT_THAT(messages.warnings(), Contains("continuing from step 25, the last one copied to main memory"));
    }
  }
}

TEST_F(ResidentFits, MemoryThatIsNotThereCostsNothing) {
  const auto counting = std::make_shared<FaultyDevice>(device_, GpuFaults{});
  const double expected = OnGpu(counting).report.train.psnr;
  for (const double part : {0.0, 0.1, 0.5, 0.95}) {
    const Messages messages;
    const auto faulty = std::make_shared<FaultyDevice>(
        device_, GpuFaults{.allocations = static_cast<int>(part * static_cast<double>(counting->allocations()))});
    const Fitted fitted = OnGpu(faulty);
    EXPECT_EQ(fitted.report.steps, 60);
    EXPECT_NEAR(fitted.report.train.psnr, expected, kAlike) << part;
    EXPECT_FALSE(messages.warnings().empty());
    EXPECT_THAT(messages.warnings(), testing::Not(Contains(HasSubstr("continuing from step")))) << part;
  }
}

TEST_F(ResidentFits, SplitWhatAKernelDoesNotSee) {
  // Coefficients of degree 3 are 192 bytes a row: blocks of 256 rows, of 700 Gaussians.
  options_.sh_degree_interval = 5;
  options_.steps = 12;
  options_.densification.max_gaussians = 900;
  const GaussianCloud initial =
      InitialCloud(RandomPointsInView(700, views_.train, views_.scene_scale, 3), views_.scene_scale, {.seed = 3})
          .value();
  const auto fit = [&](std::shared_ptr<GpuDevice> device) {
    const RunOnGpu run(std::move(device));
    return Fit(views_, initial, options_).value();
  };
  const Messages messages;
  const Fitted whole = fit(device_);
  const Fitted split = fit(std::make_shared<FaultyDevice>(device_, GpuFaults{.max_binding = 100'000}));
  EXPECT_THAT(messages.warnings(), IsEmpty());
  EXPECT_NE(whole.cloud.size(), 700);
  ExpectSameCloud(split.cloud, whole.cloud);
}

TEST_F(ResidentFits, RowsThatAreNoNumbersArePruned) {
  GaussianCloud cloud = orbit_scene::Ball(40, 2);
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  cloud.means[3] = nan;
  cloud.log_scales[6] = 45;
  cloud.quats[12] = infinity;
  cloud.opacity_logits[4] = nan;
  cloud.sh[15] = -infinity;
  cloud.log_scales[18] = -infinity;  // flat, and legal
  cloud.opacity_logits[7] = infinity;
  cloud.log_scales[24] = nan;
  const FitState state = Fitter::Fresh(cloud);
  const auto fit = ResidentFit::Begin(device_, state.cloud, state.optimizer, state.densification);
  ASSERT_TRUE(fit.ok()) << fit.error().message;
  DensificationOptions options;
  const auto plan = (*fit)->Plan(options, 100, 1, 3);
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  std::vector<int64_t> kept;
  for (int64_t i = 0; i < 40; ++i) {
    if (IsUsable(cloud, i)) kept.push_back(i);
  }
  ASSERT_EQ(kept.size(), 34u);
  EXPECT_THAT(plan->change.rows.kept, testing::ElementsAreArray(kept));
  ASSERT_TRUE((*fit)->Apply(options, *plan).ok());
  FitState after = state;
  ASSERT_TRUE((*fit)->Read(after.cloud, after.optimizer, after.densification).ok());
  ExpectSameCloud(after.cloud, Subset(cloud, kept).value());
}

}  // namespace
}  // namespace anchorsplat
