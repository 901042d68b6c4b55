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

// The strategy that adds and removes Gaussians.
enum class Strategy {
  kDefault,  // Densification, gsplat's DefaultStrategy
  kMcmc,     // McmcAfterStep, gsplat's MCMCStrategy
};

// Presets of gsplat's trainer, and DefaultStrategy(absgrad=True) with the threshold recommended for it.
enum class FitPreset {
  kDefault,
  kAbsgrad,  // kDefault with DensificationOptions::absgrad
  kMcmc,     // also sets regularizers and the start (StartOptions)
};

// A standard 3DGS optimisation (Kerbl et al. 2023) with the numbers of gsplat's simple_trainer. FitOptionsFor scales
// them to a number of steps; the fields hold the scaled values.
struct FitOptions {
  int64_t steps = kStandardSteps;
  uint64_t seed = 0;
  int64_t sh_degree_interval = 1000;  // steps per degree: uses min(step / interval, 3)
  LearningRates rates;
  Strategy strategy = Strategy::kDefault;
  DensificationOptions densification;  // of Strategy::kDefault
  McmcOptions mcmc;                    // of Strategy::kMcmc
  Regularizers regularizers;
  // Includes Mip-Splatting's 3-D smoothing filter (fit/mip_filter.h) in the Gaussians. Sizes are updated every
  // `mip_filter_every` steps and when Gaussians are added or moved, except in the last such interval. Set by
  // UseMipFilter.
  bool mip_filter = false;
  int64_t mip_filter_every = 100;
  ObjectiveOptions objective;  // `pixel` is set by the schedule, `absgrad` by the densification
  PixelSchedule pixel;
  // Step from which per-view gain and bias (fit/exposure_per_view.h) are removed from pictures; −1: never.
  int64_t exposure_from = -1;
  FarUnits far = {};  // for a far shell, set by AddFarShell
};

// Step at which --exposure begins: before, pictures and renders differ by more than exposure.
inline int64_t ExposureFrom(int64_t steps) { return steps / 30; }

inline constexpr int64_t kDefaultFitSteps = 15000;  // as the low-quality splats of the paper's data set

FitOptions FitOptionsFor(int64_t steps = kDefaultFitSteps, FitPreset preset = FitPreset::kDefault);

// Enables the 3-D smoothing filter and its rendering (MipRendering).
void UseMipFilter(FitOptions& options);

// How points become the initial Gaussians of such a fit.
InitialCloudOptions StartOptions(const FitOptions& options);

// World units per unit of MCMC's noise and the scale regularizer (McmcStep::unit): the largest distance of a camera
// from the cameras' mean, or 1 if that is 0.
double UnitOf(double scene_scale);

// SH degree in use at a step.
int ShDegreeAt(const FitOptions& options, int64_t step);

// Pixel model of a step.
PixelModel PixelModelAt(const FitOptions& options, int64_t step);

// kBadArgument for invalid options: steps below 1, negative rates, …, or the smoothing filter together with pixel
// areas, which are a different filter.
Status Validate(const FitOptions& options);

// All options as one JSON object. Equal text, views and start mean an identical fit.
std::string ToJsonText(const FitOptions& options);

}  // namespace anchorsplat
