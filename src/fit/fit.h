#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "fit/fit_options.h"
#include "fit/fitter.h"
#include "fit/training_views.h"
#include "fit/view_quality.h"

namespace anchorsplat {

// How a fit is run, besides what it computes (FitOptions).
struct FitControl {
  std::filesystem::path checkpoint;            // empty: none is written or read
  int64_t checkpoint_every = 0;                // steps; 0: only when interrupted
  bool resume = false;                         // go on from `checkpoint` if it is there
  bool keep_checkpoint = false;                // when the fit ends: its caller removes it, once the result is safe
  const std::atomic<bool>* stop = nullptr;     // becomes true when the user wants to stop
  std::function<void(const Fitter&)> observe;  // after every step; may be empty
};

// What was done, for people and for --json.
struct FitReport {
  int64_t steps = 0;         // done in all
  int64_t resumed_at = 0;    // steps that a checkpoint brought
  bool interrupted = false;  // then the qualities are not measured
  int64_t gaussians_in = 0;  // that the fit (not its continuation) began with
  int64_t gaussians_out = 0;
  int64_t duplicated = 0, split = 0, pruned = 0;  // in this run
  double loss = 0;                                // of the last step
  double scene_scale = 0;
  ViewQuality train, held_out;
  double seconds = 0;  // of the steps in this run
  FitTimes times;
};

struct Fitted {
  GaussianCloud cloud;
  FitReport report;
};

// Fits Gaussians that begin as `initial` to the training views: the whole of an optimisation, with progress, an
// interruption that loses nothing, and the quality at its end. When `control.stop` becomes true the result so far comes
// back with `interrupted` set and the checkpoint is written; when a fit ends, its checkpoint is removed, unless the
// caller keeps it until the result is safe.
//
// Errors: those of Fitter and of the checkpoint's file.
Result<Fitted> Fit(const TrainingViews& views, GaussianCloud initial, const FitOptions& options,
                   const FitControl& control = {});

}  // namespace anchorsplat
