#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/gaussian_cloud.h"
#include "core/image.h"
#include "core/result.h"
#include "fit/densification.h"
#include "fit/fit_options.h"
#include "fit/fit_state.h"
#include "fit/mip_filter.h"
#include "fit/picture_cache.h"
#include "fit/residence.h"
#include "fit/view_objective.h"
#include "fit/view_order.h"

namespace anchorsplat {

// Notes which of these files an interruption will leave besides its checkpoint. Call before they are written.
void Leave(FitState& state, std::span<const std::filesystem::path> files);

// Outcome of one step.
struct FitStep {
  int64_t view = 0;
  DensificationChange change;
};

// Wall-clock seconds of all steps so far. GPU work overlaps with the host and counts where the host waits for it,
// mostly in rendering.
struct FitTimes {
  double load = 0;  // pictures from the cache
  ObjectiveTimes objective;
  double adam = 0, densify = 0;  // `densify` includes measuring filters
};

// The optimisation loop of a fit, one step at a time: view, objective, optimizer, densification. The state after k
// steps is the same bits for any number of threads, resumed or not.
//
// With a GPU in the run (RunContext::device) the state lives there (fit/residence.h), unless the fit needs what the GPU
// lacks: MCMC, a smoothing filter, regularizers, a far shell. Such a fit, or one that does not fit into its memory,
// only renders there. The state then equals the CPU's up to rounding, with the same bits in every run. Losing the GPU
// costs at most kCopyToHostEvery steps, which are repeated.
class Fitter {
 public:
  // `pictures`: the training views, at least one. Continues at `state.step`.
  // Errors (kBadArgument): invalid options; no views; no Gaussians; an invalid cloud; a state without what the options
  // need.
  static Result<Fitter> Begin(const FitOptions& options, PictureCache pictures, double scene_scale, FitState state);
  // The state at step 0.
  static FitState Fresh(GaussianCloud cloud);

  // Runs one step. Errors: those of PictureCache and ViewObjective; kBadArgument when pruning left no Gaussian.
  Result<FitStep> Step();

  bool done() const { return state_.step >= options_.steps; }
  int64_t step() const { return state_.step; }  // steps done
  int64_t size() const;                         // Gaussians
  // Copies from the GPU if needed. If that is lost, this is an older state and step() is its step.
  const FitState& state();
  void Leave(std::span<const std::filesystem::path> files) { anchorsplat::Leave(state_, files); }
  const FitOptions& options() const { return options_; }
  PictureCache& pictures() { return pictures_; }
  FitTimes times() const;
  // Of the last step, before its update: loss (NaN without one) and PSNR of its picture (0 without one).
  double LastLoss();
  double LastPsnr();
  // A copy of the cloud as rendered: smoothing filter fused, non-finite rows removed.
  GaussianCloud UsableCloud();

 private:
  Fitter(const FitOptions& options, PictureCache pictures, double scene_scale, FitState state);

  // Whether the whole fit can run on the GPU.
  bool CanReside() const;
  // A step without densification, on the loaded view `view`.
  Status Learn(const ObjectiveOptions& objective, const Camera& camera, int64_t view);
  Status LearnOnGpu(const ObjectiveOptions& objective, const Camera& camera, int64_t view);
  // Densification after a step. `gradient`: of that step, or null if accumulated on the GPU.
  DensificationChange ChangeGaussians(const Camera& rays, const CloudGradient* gradient);
  Result<DensificationChange> ChangeOnGpu(const Camera& rays);
  bool FollowsExposure() const { return options_.exposure_from >= 0 && state_.step >= options_.exposure_from; }
  bool CutsToBudget(int64_t step) const;
  // At the end of growth, removes what exceeds the limit, least opacity × size first. Only a larger start can exceed
  // it. The remaining steps compensate.
  void KeepToBudget(int64_t step, DensificationChange& change);
  void MeasureMipFilter();

  FitOptions options_;
  PictureCache pictures_;
  double scene_scale_;
  FitState state_;
  ViewOrder order_;
  ViewObjective objective_;
  MipFiltered filtered_;
  CloudGradient gradient_;
  Image picture_;
  Buffer<uint8_t> ignored_;  // of picture_
  double last_loss_, last_psnr_ = 0;
  Residence residence_;
  ObjectiveTimes gpu_times_;
  FitTimes times_;
};

// Writes a state as a safetensors file: the cloud, Adam's moments, and, if present, densification's sums and the
// filter, all exact. Metadata: the step, `settings` (JSON object of what the fit depends on) and a checksum. Written
// whole or not at all; replaces an older file.
Status WriteFitCheckpoint(const std::filesystem::path& path, const FitState& state, const std::string& settings);

// Whether the file declares itself such a checkpoint, of this version or an earlier one; false if unreadable.
bool IsFitCheckpoint(const std::filesystem::path& path);

// Deletes the file if it is such a checkpoint.
void RemoveFitCheckpoint(const std::filesystem::path& path);

// The checkpoint's `left` files that are unchanged since NoteFilesLeft; replaced or modified ones are not the run's.
// Empty if the checkpoint cannot be read.
std::vector<std::string> FilesLeftWith(const std::filesystem::path& checkpoint);

// Records in the checkpoint the versions of the `left` files, once written. Errors: reading or writing fails; then none
// counts as left.
Status NoteFilesLeft(const std::filesystem::path& checkpoint);

// Name of a file in `left`: its absolute path without "..", as printable text.
std::string AbsoluteName(const std::filesystem::path& file);

// Reads a checkpoint. Errors: those of TensorFile; kBadFile: no such checkpoint, an earlier version, or damaged;
// kBadArgument: settings differ from `settings` (names the first difference).
Result<FitState> ReadFitCheckpoint(const std::filesystem::path& path, const std::string& settings);

}  // namespace anchorsplat
