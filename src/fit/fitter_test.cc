#include "fit/fitter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <vector>

#include "core/parallel.h"
#include "fit/fit.h"
#include "fit/initial_cloud.h"
#include "fit/orbit_scene_test.h"
#include "formats/safetensors.h"
#include "formats/test_cloud.h"
#include "formats/test_folder.h"

namespace anchorsplat {
namespace {

using testing::HasSubstr;

constexpr int kSide = 24;

// A tiny project, and a short schedule in which everything happens.
class Fits : public testing::Test {
 protected:
  void SetUp() override {
    orbit_scene::Write(folder_.path(), orbit_scene::Ball(20, 1), 10, kSide);
    views_ = OpenProject(folder_.path(), {.hold_out = 5}).value();
    options_ = FitOptionsFor(60);
    options_.seed = 3;
    options_.densification.refine_start_iter = 5;
    options_.densification.refine_every = 4;
    options_.densification.refine_stop_iter = 40;
    options_.densification.reset_every = 20;
    options_.densification.max_gaussians = 150;
  }

  GaussianCloud Initial() const {
    return InitialCloud(RandomPointsInView(60, views_.train, views_.scene_scale, 3), views_.scene_scale, {.seed = 3})
        .value();
  }
  Fitter Begin(FitState state) const {
    return Fitter::Begin(options_, PictureCache(views_.train, {0, 0, 0}), views_.scene_scale, std::move(state)).value();
  }

  TestFolder folder_;
  TrainingViews views_;
  FitOptions options_;
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

TEST_F(Fits, AnInterruptionLosesNothing) {
  const auto whole = Fit(views_, Initial(), options_);
  ASSERT_TRUE(whole.ok());
  std::atomic<bool> stop{false};
  FitControl control;
  control.checkpoint = folder_ / "state";
  control.stop = &stop;
  control.observe = [&](const Fitter& fitter) { stop = fitter.state().step >= 31; };
  const auto first = Fit(views_, Initial(), options_, control);
  ASSERT_TRUE(first.ok());
  EXPECT_TRUE(first->report.interrupted);
  EXPECT_EQ(first->report.steps, 31);
  EXPECT_TRUE(Validate(first->cloud).ok());
  EXPECT_TRUE(std::filesystem::exists(control.checkpoint));

  control.observe = nullptr;
  stop = false;
  control.resume = true;
  const auto second = Fit(views_, Initial(), options_, control);
  ASSERT_TRUE(second.ok()) << second.error().message;
  EXPECT_FALSE(second->report.interrupted);
  EXPECT_EQ(second->report.resumed_at, 31);
  EXPECT_EQ(second->report.steps, 60);
  ExpectSameCloud(second->cloud, whole->cloud);
  EXPECT_FALSE(std::filesystem::exists(control.checkpoint)) << "a finished fit has no state to keep";
}

TEST_F(Fits, CheckpointsComeInTime) {
  FitControl control;
  control.checkpoint = folder_ / "state";
  control.checkpoint_every = 25;
  std::vector<int64_t> seen;
  control.observe = [&](const Fitter& fitter) {
    if (std::filesystem::exists(control.checkpoint)) seen.push_back(fitter.state().step);
  };
  ASSERT_TRUE(Fit(views_, Initial(), options_, control).ok());
  ASSERT_FALSE(seen.empty());
  EXPECT_EQ(seen.front(), 26);
}

TEST_F(Fits, ACheckpointOfAnotherFitIsRefused) {
  std::atomic<bool> stop{true};
  FitControl control;
  control.checkpoint = folder_ / "state";
  control.stop = &stop;
  ASSERT_TRUE(Fit(views_, Initial(), options_, control).ok());
  control.resume = true;
  options_.densification.grow_grad2d = 0.0003;
  auto fitted = Fit(views_, Initial(), options_, control);
  ASSERT_FALSE(fitted.ok());
  EXPECT_EQ(fitted.error().code, ErrorCode::kBadArgument);
  EXPECT_THAT(fitted.error().message, HasSubstr("its grow_grad2d is 0.0002, this one's is 0.0003"));
  options_.densification.grow_grad2d = 0.0002;
  views_.train.pop_back();
  EXPECT_THAT(Fit(views_, Initial(), options_, control).error().message, HasSubstr("another run: its view"));
}

TEST_F(Fits, ACheckpointOfAVersionWithFewerSettingsIsABadFile) {
  const auto path = folder_ / "state";
  FitState state = Fitter::Fresh(Initial());
  ASSERT_TRUE(WriteFitCheckpoint(path, state, R"({"steps":7})").ok());
  const auto read = ReadFitCheckpoint(path, R"({"steps":7,"temperature":1})");
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().code, ErrorCode::kBadFile);  // which builders take as a reason to begin anew
  EXPECT_THAT(read.error().message, HasSubstr("another version, which knew no temperature"));
}

TEST_F(Fits, DamagedCheckpointsAreRefused) {
  const auto path = folder_ / "state";
  FitState state = Fitter::Fresh(Initial());
  ASSERT_TRUE(WriteFitCheckpoint(path, state, "{}").ok());
  ASSERT_TRUE(ReadFitCheckpoint(path, "{}").ok());
  const auto rewrite = [&](const std::string& without, const std::string& step) {
    const TensorFile file = TensorFile::Open(path).value();
    std::vector<TensorEntry> entries;
    for (const TensorEntry& entry : file.tensors()) {
      if (entry.name != without) entries.push_back(entry);
    }
    auto metadata = file.metadata();
    metadata["step"] = step;
    EXPECT_TRUE(WriteSafetensors(folder_ / "damaged", entries, metadata, {.overwrite = true}).ok());
    return ReadFitCheckpoint(folder_ / "damaged", "{}");
  };
  EXPECT_THAT(rewrite("adam.sh.second", "0").error().message, HasSubstr("adam.sh.second"));
  EXPECT_THAT(rewrite("cloud.sh", "0").error().message, HasSubstr("cloud.sh"));
  EXPECT_THAT(rewrite("", "-1").error().message, HasSubstr("number of steps"));
  EXPECT_THAT(rewrite("", "x").error().message, HasSubstr("number of steps"));
  EXPECT_TRUE(rewrite("", "7").ok());
  EXPECT_EQ(rewrite("", "7")->optimizer.steps(), 7);
  ASSERT_TRUE(WriteSafetensors(path, {}, {}, {.overwrite = true}).ok());
  EXPECT_THAT(ReadFitCheckpoint(path, "{}").error().message, HasSubstr("not a checkpoint of a fit"));
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
  EXPECT_THAT(fitted.error().message, HasSubstr("no Gaussian"));
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
