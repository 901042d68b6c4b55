#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "fit/fit_options.h"
#include "fit/fitter.h"
#include "fit/training_views.h"
#include "fit/view_quality.h"

namespace anchorsplat {

struct Fitted;

// How a fit is run, besides what it computes (FitOptions).
struct FitControl {
  std::filesystem::path checkpoint;  // empty: none
  int64_t checkpoint_every = 0;      // steps; 0: only when the fit is interrupted
  bool resume = false;               // resume from `checkpoint` if it exists
  // If the checkpoint is damaged, of another version or of another run: true starts anew with a warning, for callers
  // who own it; false is an error. The file stays until a new state replaces it.
  bool anew_if_unfit = false;
  std::vector<std::filesystem::path> outputs;  // files the caller will write, even after an interruption
  std::function<void(const Fitter&)> observe;  // called after every step; may be empty
  // Stores the result, also of an interrupted fit; may be empty. Called before quality is measured. The state is kept
  // until it succeeds.
  std::function<Status(const Fitted&)> deliver;
};

// What was done, for the log and for --json.
struct FitReport {
  int64_t steps = 0;         // in total
  int64_t resumed_at = 0;    // steps from a checkpoint
  bool interrupted = false;  // if so, quality is not measured
  // For an interrupted fit: the step in the checkpoint. Less than `steps` if there was no space for a newer one; unset
  // if there is no checkpoint.
  std::optional<int64_t> kept_step;
  int64_t gaussians_in = 0;  // at step 0, also when resumed
  int64_t gaussians_out = 0;
  int64_t duplicated = 0, split = 0, pruned = 0;           // in this run
  int64_t relocated = 0, added = 0;                        // in this run, of MCMC
  double loss = std::numeric_limits<double>::quiet_NaN();  // of this run's last step; NaN without steps
  double scene_scale = 0;
  ViewQuality train, held_out;
  double seconds = 0;  // of the steps in this run
  FitTimes times;
};

struct Fitted {
  GaussianCloud cloud;
  FitReport report;
};

// Runs a whole optimisation of `initial` against the training views, with progress, safe interruption, and final
// quality. When asked to stop (core/run_context.h), writes the checkpoint and returns the result so far with
// `interrupted` set. A failed checkpoint write is only a warning. After any other failure the state is kept in the
// checkpoint, and the message says so. The checkpoint is deleted once the fit is done and the result delivered.
//
// A checkpoint belongs to these options, views (cameras and bytes of pictures) and start.
//
// Errors: those of Fitter and `deliver`; with a checkpoint, of ReadFitCheckpoint and FingerprintOfPictures.
Result<Fitted> Fit(const TrainingViews& views, GaussianCloud initial, const FitOptions& options,
                   const FitControl& control = {});

}  // namespace anchorsplat
