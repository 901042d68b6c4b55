#pragma once

#include <cstdint>
#include <string>

#include "core/result.h"
#include "fit/cloud_optimizer.h"
#include "fit/densification.h"
#include "fit/far_units.h"
#include "fit/initial_cloud.h"
#include "fit/mcmc.h"
#include "fit/regularizers.h"
#include "fit/view_objective.h"

namespace anchorsplat {

// Who decides which Gaussians come and go.
enum class Strategy {
  kDefault,  // Densification, gsplat's DefaultStrategy
  kMcmc,     // McmcAfterStep, gsplat's MCMCStrategy
};

// Options that belong together: what gsplat's trainer calls its presets, and DefaultStrategy(absgrad=True) with the
// threshold that it recommends for that.
enum class FitPreset {
  kDefault,
  kAbsgrad,  // kDefault with DensificationOptions::absgrad
  kMcmc,     // with regularizers and a start of its own (StartOptions)
};

// A standard 3DGS optimisation (Kerbl et al. 2023) with the numbers of gsplat's simple_trainer. FitOptionsFor gives
// them for a number of steps; the fields hold what applies, already scaled.
struct FitOptions {
  int64_t steps = kStandardSteps;
  uint64_t seed = 0;
  int64_t sh_degree_interval = 1000;  // steps per degree: min(step / interval, 3) is in use
  LearningRates rates;
  Strategy strategy = Strategy::kDefault;
  DensificationOptions densification;  // of Strategy::kDefault
  McmcOptions mcmc;                    // of Strategy::kMcmc
  Regularizers regularizers;
  // Mip-Splatting's 3-D smoothing filter (fit/mip_filter.h) is part of the Gaussians, and sizes follow the cameras
  // every so many steps and whenever Gaussians come or move, until as many steps before the end. UseMipFilter sets it.
  bool mip_filter = false;
  int64_t mip_filter_every = 100;
  ObjectiveOptions objective;  // its `pixel` follows from the schedule, its `absgrad` from the densification
  PixelSchedule pixel;
  // Views differ in brightness and tint: each has a gain and a bias per channel of its own (fit/exposure_per_view.h),
  // which are taken out of its picture from this step on; −1: never.
  int64_t exposure_from = -1;
  FarUnits far = {};  // of a fit with a far shell (AddFarShell sets them)
};

// Where --exposure begins: before that, pictures and renders differ by more than their exposure.
inline int64_t ExposureFrom(int64_t steps) { return steps / 30; }

inline constexpr int64_t kDefaultFitSteps = 15000;  // what the low-quality splats of the paper's data set had

FitOptions FitOptionsFor(int64_t steps = kDefaultFitSteps, FitPreset preset = FitPreset::kDefault);

// Switches the 3-D smoothing filter on, and the rendering that belongs to it (MipRendering).
void UseMipFilter(FitOptions& options);

// How the points become Gaussians with which such a fit begins.
InitialCloudOptions StartOptions(const FitOptions& options);

// The unit in which MCMC's noise and the regulariser of scales are meant (McmcStep::unit), in world units: the largest
// distance of a camera from the cameras' mean, or 1 where that is 0.
double UnitOf(double scene_scale);

// Spherical harmonics in use at a step.
int ShDegreeAt(const FitOptions& options, int64_t step);

// How the pixels of a step get their values.
PixelModel PixelModelAt(const FitOptions& options, int64_t step);

// kBadArgument for what cannot be run: steps below 1, rates that are negative, …, or the smoothing filter with areas of
// pixels, which are filters of another kind.
Status Validate(const FitOptions& options);

// All options as one JSON object: two fits with equal text, equal views and an equal start are the same fit.
std::string ToJsonText(const FitOptions& options);

}  // namespace anchorsplat
