#pragma once

#include <cstdint>
#include <string>

#include "core/result.h"
#include "fit/cloud_optimizer.h"
#include "fit/densification.h"
#include "fit/view_objective.h"

namespace anchorsplat {

// A standard 3DGS optimisation (Kerbl et al. 2023) with the numbers of gsplat's simple_trainer. FitOptionsFor gives
// them for a number of steps; the fields hold what applies, already scaled.
struct FitOptions {
  int64_t steps = kStandardSteps;
  uint64_t seed = 0;
  int64_t sh_degree_interval = 1000;  // steps per degree: min(step / interval, 3) is in use
  LearningRates rates;
  DensificationOptions densification;
  ObjectiveOptions objective;  // its `pixel` follows from the schedule
  PixelSchedule pixel;
};

inline constexpr int64_t kDefaultFitSteps = 15000;  // what the low-quality splats of the paper's data set had

FitOptions FitOptionsFor(int64_t steps = kDefaultFitSteps);

// Spherical harmonics in use at a step.
int ShDegreeAt(const FitOptions& options, int64_t step);

// How the pixels of a step get their values.
PixelModel PixelModelAt(const FitOptions& options, int64_t step);

// kBadArgument for what cannot be run: steps below 1, rates that are negative, …
Status Validate(const FitOptions& options);

// All options as one JSON object: two fits with equal text, equal views and an equal start are the same fit.
std::string ToJsonText(const FitOptions& options);

}  // namespace anchorsplat
