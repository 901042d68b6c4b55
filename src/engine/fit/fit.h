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
  std::filesystem::path checkpoint;  // empty: none is written or read
  int64_t checkpoint_every = 0;      // steps; 0: only when the fit ends before its end
  bool resume = false;               // go on from `checkpoint` if it is there
  // What to do with a checkpoint that is damaged, another version's or another run's: begin anew with a warning, where
  // the caller knows that it is its own; else that is an error. The file stays until a new state takes its place.
  bool anew_if_unfit = false;
  std::vector<std::filesystem::path> outputs;  // that its caller writes, also when it was interrupted
  std::function<void(const Fitter&)> observe;  // after every step; may be empty
  // Brings the result to safety, also that of an interrupted fit; may be empty. Called before qualities are measured.
  // As long as it has not succeeded the state is kept.
  std::function<Status(const Fitted&)> deliver;
};

// What was done, for people and for --json.
struct FitReport {
  int64_t steps = 0;         // done in all
  int64_t resumed_at = 0;    // steps that a checkpoint brought
  bool interrupted = false;  // then the qualities are not measured
  // Of an interrupted fit: the step of the state that the checkpoint holds. Less than `steps` when there was no room
  // for a newer one; nothing when there is none at all.
  std::optional<int64_t> kept_step;
  int64_t gaussians_in = 0;  // that the fit (not its continuation) began with
  int64_t gaussians_out = 0;
  int64_t duplicated = 0, split = 0, pruned = 0;           // in this run
  int64_t relocated = 0, added = 0;                        // in this run, of MCMC
  double loss = std::numeric_limits<double>::quiet_NaN();  // of the last step of this run, if it made any
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
// interruption that loses nothing, and the quality at its end. When the run is asked to stop (core/run_context.h) the
// result so far comes back with `interrupted` set and the checkpoint is written. A checkpoint that cannot be written is
// a warning and costs no more than itself. When anything else fails, the state is kept in the checkpoint, and the
// message says so; when a fit has ended and its result was delivered, the checkpoint is removed.
//
// A checkpoint belongs to these options, views (cameras and the bytes of their pictures) and this start.
//
// Errors: those of Fitter, `deliver`, ReadFitCheckpoint and, with a checkpoint, of FingerprintOfPictures.
Result<Fitted> Fit(const TrainingViews& views, GaussianCloud initial, const FitOptions& options,
                   const FitControl& control = {});

}  // namespace anchorsplat
