// Every strategy, and the smoothing filter with each, in whole fits.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <ostream>
#include <string>
#include <utility>

#include "core/parallel.h"
#include "core/run_context.h"
#include "fit/fit.h"
#include "fit/initial_cloud.h"
#include "fit/orbit_scene_for_test.h"
#include "formats/random_cloud_for_test.h"
#include "io/folder_for_test.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {
namespace {

using testing::HasSubstr;

struct Kind {
  const char* name;
  FitPreset preset;
  bool mip_filter;
  int64_t steps;           // MCMC begins with specks and needs more
  double train, held_out;  // dB that are reached at least
};
void PrintTo(const Kind& kind, std::ostream* out) { *out << kind.name; }

class Strategies : public testing::TestWithParam<Kind> {
 protected:
  void SetUp() override {
    orbit_scene::Write(folder_.path(), orbit_scene::Ball(20, 1), 10, 24);
    views_ = OpenProject(folder_.path(), {.hold_out = 5}).value();
  }

  FitOptions Options(int64_t steps) const {
    FitOptions options = FitOptionsFor(steps, GetParam().preset);
    options.seed = 3;
    options.mcmc.cap_max = options.densification.max_gaussians = 150;
    if (GetParam().mip_filter) UseMipFilter(options);
    return options;
  }

  // A short schedule in which everything happens.
  FitOptions ShortOptions() const {
    FitOptions options = Options(60);
    DensificationOptions& d = options.densification;
    options.mcmc.refine_start_iter = d.refine_start_iter = 5;
    options.mcmc.refine_every = d.refine_every = 4;
    options.mcmc.refine_stop_iter = d.refine_stop_iter = 40;
    d.reset_every = 20;
    options.mip_filter_every = 7;
    return options;
  }

  GaussianCloud Initial(const FitOptions& options) const {
    const InitialPoints points = RandomPointsInView(60, views_.train, views_.scene_scale, 3);
    return InitialCloud(points, views_.scene_scale, StartOptions(options)).value();
  }

  Fitter Begin(const FitOptions& options, FitState state) const {
    return Fitter::Begin(options, PictureCache(views_.train, {0, 0, 0}), views_.scene_scale, std::move(state)).value();
  }

  TestFolder folder_;
  TrainingViews views_;
};

void ExpectSameFit(const FitState& a, const FitState& b) {
  EXPECT_EQ(a.step, b.step);
  ExpectSameCloud(a.cloud, b.cloud);
  for (size_t k = 0; k < a.optimizer.moments().size(); ++k) {
    EXPECT_TRUE(SameBits(a.optimizer.moments()[k].first, b.optimizer.moments()[k].first)) << k;
    EXPECT_TRUE(SameBits(a.optimizer.moments()[k].second, b.optimizer.moments()[k].second)) << k;
  }
  EXPECT_TRUE(SameBits(a.densification.gathered().grad2d, b.densification.gathered().grad2d));
  EXPECT_TRUE(SameBits(a.mip_filter, b.mip_filter));
}

// On average: what so few steps on so small a picture reach depends on the last bits, by 1 dB.
TEST_P(Strategies, LearnsAKnownSplat) {
  FitOptions options = Options(GetParam().steps);
  constexpr int kFits = 8;
  double train = 0, held_out = 0;
  for (int fit = 0; fit < kFits; ++fit) {
    options.seed = static_cast<uint64_t>(3 + fit);
    const auto fitted = Fit(views_, Initial(options), options);
    ASSERT_TRUE(fitted.ok()) << fitted.error().message;
    train += fitted->report.train.psnr / kFits;
    held_out += fitted->report.held_out.psnr / kFits;
    EXPECT_LE(fitted->cloud.size(), 150);
    EXPECT_EQ(fitted->cloud.render_mode, GetParam().mip_filter ? RenderMode::kMip : RenderMode::kClassic);
    const bool mcmc = GetParam().preset == FitPreset::kMcmc;
    EXPECT_EQ(fitted->report.relocated > 0, mcmc);
    EXPECT_EQ(fitted->report.added > 0, mcmc);
    EXPECT_EQ(fitted->report.pruned > 0, !mcmc);
  }
  EXPECT_GT(train, GetParam().train);
  EXPECT_GT(held_out, GetParam().held_out);
}

TEST_P(Strategies, GoingOnFromACheckpointGivesTheSameBits) {
  const FitOptions options = ShortOptions();
  const auto path = folder_ / "state";
  Fitter whole = Begin(options, Fitter::Fresh(Initial(options)));
  while (!whole.done()) {
    ASSERT_TRUE(whole.Step().ok());
    // In the middle of an epoch, between two growths, with gradients gathered.
    if (whole.state().step != 27) continue;
    ASSERT_TRUE(WriteFitCheckpoint(path, whole.state(), "{}").ok());
  }
  ASSERT_NE(whole.state().cloud.size(), 60) << "the test is about changing rows";
  auto state = ReadFitCheckpoint(path, "{}");
  ASSERT_TRUE(state.ok()) << state.error().message;
  Fitter rest = Begin(options, *std::move(state));
  while (!rest.done()) ASSERT_TRUE(rest.Step().ok());
  ExpectSameFit(rest.state(), whole.state());
}

TEST_P(Strategies, SameBitsForAnyNumberOfThreads) {
  const FitOptions options = ShortOptions();
  FitState expected;
  for (const int threads : {1, 2, 5}) {
    SetThreadCount(threads);
    Fitter fitter = Begin(options, Fitter::Fresh(Initial(options)));
    while (!fitter.done()) ASSERT_TRUE(fitter.Step().ok());
    if (threads == 1) expected = fitter.state();
    ExpectSameFit(fitter.state(), expected);
  }
  SetThreadCount(0);
}

TEST_P(Strategies, WhatIsExportedLooksLikeWhatIsOptimised) {
  const FitOptions options = ShortOptions();
  Fitter fitter = Begin(options, Fitter::Fresh(Initial(options)));
  while (!fitter.done()) ASSERT_TRUE(fitter.Step().ok());
  const GaussianCloud exported = fitter.UsableCloud(), &stored = fitter.state().cloud;
  ASSERT_EQ(exported.size(), stored.size());
  EXPECT_EQ(exported.log_scales == stored.log_scales, !GetParam().mip_filter);
  for (size_t i = 0; i < stored.log_scales.size(); ++i) EXPECT_GE(exported.log_scales[i], stored.log_scales[i]);
}

constexpr Kind kKinds[] = {
    {"default", FitPreset::kDefault, false, 300, 24, 23},    {"absgrad", FitPreset::kAbsgrad, false, 300, 24, 23},
    {"mcmc", FitPreset::kMcmc, false, 3000, 36, 27},         {"default_mip", FitPreset::kDefault, true, 300, 24, 23},
    {"absgrad_mip", FitPreset::kAbsgrad, true, 300, 24, 23}, {"mcmc_mip", FitPreset::kMcmc, true, 3000, 36, 26},
};
INSTANTIATE_TEST_SUITE_P(All, Strategies, testing::ValuesIn(kKinds),
                         [](const auto& kind) { return std::string(kind.param.name); });

TEST(FitStrategies, AStateOfAnotherStrategyIsRefused) {
  TestFolder folder;
  orbit_scene::Write(folder.path(), orbit_scene::Ball(20, 1), 10, 24);
  const TrainingViews views = OpenProject(folder.path(), {.hold_out = 5}).value();
  const FitOptions mcmc = FitOptionsFor(60, FitPreset::kMcmc), standard = FitOptionsFor(60);
  const GaussianCloud initial =
      InitialCloud(RandomPointsInView(60, views.train, views.scene_scale, 3), views.scene_scale, StartOptions(mcmc))
          .value();
  std::atomic<bool> stop{true};
  FitControl control;
  control.checkpoint = folder / "state";
  const RunScope run({.stop = &stop});
  ASSERT_TRUE(Fit(views, initial, mcmc, control).ok());
  control.resume = true;
  const auto fitted = Fit(views, initial, standard, control);
  ASSERT_FALSE(fitted.ok());
  EXPECT_EQ(fitted.error().code, ErrorCode::kBadArgument);
  EXPECT_THAT(fitted.error().message, HasSubstr("is a checkpoint of another run"));
  FitOptions filtered = mcmc;
  UseMipFilter(filtered);
  EXPECT_FALSE(Fit(views, initial, filtered, control).ok());
  // What differs is said in the words of the command line.
  const auto refused = [&](auto change, const GaussianCloud& start) {
    FitOptions other = mcmc;
    change(other);
    const auto resumed = Fit(views, start, other, control);
    return resumed.ok() ? "accepted" : resumed.error().message;
  };
  EXPECT_THAT(refused([](FitOptions& o) { o.objective.render.mode = RenderMode::kAntialiased; }, initial),
              HasSubstr("its --mode is \"classic\", here \"antialiased\""));
  EXPECT_THAT(refused([](FitOptions& o) { o.pixel.upscale = 4; }, initial),
              HasSubstr("its --pixel is \"point\", here \"area\""));
  EXPECT_THAT(refused([](FitOptions& o) { o.strategy = Strategy::kDefault; }, initial),
              HasSubstr("its --strategy is \"mcmc\", here \"default\""));
  EXPECT_THAT(refused([](FitOptions& o) { o.mcmc.cap_max = 6000; }, initial), HasSubstr("its --max-gaussians is "));
  EXPECT_THAT(refused([](FitOptions& o) { o.exposure_from = 5; }, initial),
              HasSubstr("its --exposure is off, here on from step 5"));
  EXPECT_THAT(refused([](FitOptions& o) { o.steps += 1, o.exposure_from = 5; }, initial), HasSubstr("its --steps is "))
      << "what others follow from comes first";
  GaussianCloud elsewhere = initial;
  elsewhere.means[0] += 1;
  EXPECT_THAT(refused([](FitOptions&) {}, elsewhere), HasSubstr("its start differs"));

  const auto begin = [&](const FitOptions& options, FitState state) {
    return Fitter::Begin(options, PictureCache(views.train, {0, 0, 0}), views.scene_scale, std::move(state));
  };
  FitState state =
      ReadFitCheckpoint(control.checkpoint, TensorFile::Open(control.checkpoint)->metadata().at("settings")).value();
  EXPECT_EQ(state.step, 1);
  EXPECT_THAT(begin(standard, state).error().message, HasSubstr("lacks densification statistics"));
  EXPECT_THAT(begin(filtered, state).error().message, HasSubstr("without the Mip-Splatting filter"));
  EXPECT_TRUE(begin(mcmc, state).ok());
}

TEST(FitStrategies, PresetsAreGsplats) {
  const FitOptions standard = FitOptionsFor(30000), absgrad = FitOptionsFor(30000, FitPreset::kAbsgrad),
                   mcmc = FitOptionsFor(30000, FitPreset::kMcmc);
  EXPECT_FALSE(standard.densification.absgrad);
  EXPECT_EQ(standard.regularizers.opacity_reg, 0);
  EXPECT_EQ(StartOptions(standard).opacity, 0.1);
  EXPECT_TRUE(absgrad.densification.absgrad);
  EXPECT_EQ(absgrad.strategy, Strategy::kDefault);
  EXPECT_EQ(absgrad.densification.grow_grad2d, 0.0008);
  EXPECT_EQ(mcmc.strategy, Strategy::kMcmc);
  EXPECT_EQ(mcmc.regularizers.opacity_reg, 0.01);
  EXPECT_EQ(mcmc.regularizers.scale_reg, 0.01);
  EXPECT_EQ(StartOptions(mcmc).opacity, 0.5);
  EXPECT_EQ(StartOptions(mcmc).scale, 0.1);
  FitOptions smooth = mcmc;
  UseMipFilter(smooth);
  EXPECT_EQ(StartOptions(smooth).scale, 0.3);
  EXPECT_EQ(FitOptionsFor(15000, FitPreset::kMcmc).mcmc.refine_stop_iter, 12500);
  EXPECT_EQ(UnitOf(2.2), 2);
  EXPECT_EQ(UnitOf(0), 1);
}

TEST(FitStrategies, OptionsOutOfRangeAreRefused) {
  const auto refused = [](auto change) {
    FitOptions options = FitOptionsFor(60, FitPreset::kMcmc);
    EXPECT_TRUE(Validate(options).ok());
    change(options);
    return !Validate(options).ok();
  };
  EXPECT_TRUE(refused([](FitOptions& o) { o.mcmc.cap_max = 0; }));
  EXPECT_TRUE(refused([](FitOptions& o) { o.mcmc.refine_every = 0; }));
  EXPECT_TRUE(refused([](FitOptions& o) { o.mcmc.noise_lr = -1; }));
  EXPECT_TRUE(refused([](FitOptions& o) { o.mcmc.min_opacity = 0; }));
  EXPECT_TRUE(refused([](FitOptions& o) { o.regularizers.scale_reg = std::nan(""); }));
  EXPECT_TRUE(refused([](FitOptions& o) { o.mip_filter_every = 0; }));
  EXPECT_TRUE(refused([](FitOptions& o) { o.mip_filter = true; })) << "in the classic mode";
  EXPECT_TRUE(refused([](FitOptions& o) {
    UseMipFilter(o);
    o.pixel.upscale = 2;
  }));
  EXPECT_FALSE(refused([](FitOptions& o) { UseMipFilter(o); }));
}

TEST(FitStrategies, SettingsNameThemAll) {
  FitOptions options;
  const std::string before = ToJsonText(options);
  const auto differs = [&](auto change) {
    FitOptions other;
    change(other);
    return ToJsonText(other) != before;
  };
  EXPECT_TRUE(differs([](FitOptions& o) { o.strategy = Strategy::kMcmc; }));
  EXPECT_TRUE(differs([](FitOptions& o) { o.densification.absgrad = true; }));
  EXPECT_TRUE(differs([](FitOptions& o) { o.mcmc.cap_max = 7; }));
  EXPECT_TRUE(differs([](FitOptions& o) { o.mcmc.noise_lr = 7; }));
  EXPECT_TRUE(differs([](FitOptions& o) { o.mcmc.min_opacity = 0.1; }));
  EXPECT_TRUE(differs([](FitOptions& o) { o.mcmc.refine_start_iter = 7; }));
  EXPECT_TRUE(differs([](FitOptions& o) { o.mcmc.refine_stop_iter = 7; }));
  EXPECT_TRUE(differs([](FitOptions& o) { o.mcmc.refine_every = 7; }));
  EXPECT_TRUE(differs([](FitOptions& o) { o.regularizers.opacity_reg = 1; }));
  EXPECT_TRUE(differs([](FitOptions& o) { o.regularizers.scale_reg = 1; }));
  EXPECT_TRUE(differs([](FitOptions& o) { o.mip_filter = true; }));
  EXPECT_TRUE(differs([](FitOptions& o) { o.mip_filter_every = 7; }));
}

// A start above the bound: growth never passes it, and where it ends the bound is kept, from a checkpoint, too.
TEST_P(Strategies, EndWithinTheirBudget) {
  FitOptions options = ShortOptions();
  const GaussianCloud initial = Initial(options);
  options.densification.reset_every = 1000;  // what is reset and cannot grow may be pruned to the last
  options.mcmc.cap_max = options.densification.max_gaussians = 25;
  ASSERT_GT(initial.size(), 25);
  const auto fitted = Fit(views_, initial, options);
  ASSERT_TRUE(fitted.ok()) << fitted.error().message;
  EXPECT_EQ(fitted->cloud.size(), 25);
}

}  // namespace
}  // namespace anchorsplat
