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

// Before an interruption writes its results: notes which of these files it will leave besides its checkpoint.
void Leave(FitState& state, std::span<const std::filesystem::path> files);

// What one step saw.
struct FitStep {
  int64_t view = 0;
  DensificationChange change;
};

// Seconds on the clock, of all steps so far. A GPU works while the host goes on: what it takes counts where the host
// waits for it, which is mostly in rendering.
struct FitTimes {
  double load = 0;  // pictures from the cache
  ObjectiveTimes objective;
  double adam = 0, densify = 0;  // the latter with the measuring of filters
};

// The iterations of a fit, one at a time: view, objective, optimizer, densification. The state after k steps is the
// same bits for any number of threads, and whether they were made in one go or from a checkpoint.
//
// Where the run has a GPU (RunContext::device), the state stays there (fit/residence.h) unless the fit has what the GPU
// has not: MCMC, a smoothing filter, regularizers, a far shell. Such a fit and one that does not fit draws its pictures
// there. The state is then that of the CPU up to rounding, and the same bits at every run. A GPU that is lost costs at
// most kCopyHomeEvery steps, which are made again.
class Fitter {
 public:
  // `pictures` are the training views (at least one). Begins at `state.step`.
  // Errors (kBadArgument): options that cannot be run, no views, no Gaussians, an invalid cloud, a state that lacks
  // what the options need.
  static Result<Fitter> Begin(const FitOptions& options, PictureCache pictures, double scene_scale, FitState state);
  // A state at step 0.
  static FitState Fresh(GaussianCloud cloud);

  // Errors: those of PictureCache and ViewObjective; kBadArgument when pruning has left no Gaussian.
  Result<FitStep> Step();

  bool done() const { return state_.step >= options_.steps; }
  int64_t step() const { return state_.step; }  // steps done
  int64_t size() const;                         // Gaussians
  // May have to come from the GPU. When that is lost, it is an older state, and step() is that of it.
  const FitState& state();
  void Leave(std::span<const std::filesystem::path> files) { anchorsplat::Leave(state_, files); }
  const FitOptions& options() const { return options_; }
  PictureCache& pictures() { return pictures_; }
  FitTimes times() const;
  // Of the last step, before the step: its loss, NaN where there is none, and the peak signal-to-noise ratio of its
  // picture, 0 where there is none.
  double LastLoss();
  double LastPsnr();
  // A copy of the cloud as it is rendered, the smoothing filter fused, without rows that are not finite.
  GaussianCloud UsableCloud();

 private:
  Fitter(const FitOptions& options, PictureCache pictures, double scene_scale, FitState state);

  // Whether all of such a fit can be done on the GPU.
  bool CanReside() const;
  // The step but for its densification: view `view`, loaded, with what options say for it.
  Status Learn(const ObjectiveOptions& objective, const Camera& camera, int64_t view);
  Status LearnAway(const ObjectiveOptions& objective, const Camera& camera, int64_t view);
  // Densification after the step, whose gradient is at hand unless it was gathered on the GPU.
  DensificationChange ChangeGaussians(const Camera& rays, const CloudGradient* gradient);
  Result<DensificationChange> ChangeAway(const Camera& rays);
  bool FollowsExposure() const { return options_.exposure_from >= 0 && state_.step >= options_.exposure_from; }
  bool CutsToBudget(int64_t step) const;
  // Where growth ends, what is above the bound goes, least opacity × size first: the start had more, for growth never
  // passes it. The steps that are left make up for it.
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
  Buffer<uint8_t> ignored_;  // of it
  double last_loss_, last_psnr_ = 0;
  Residence residence_;
  ObjectiveTimes away_times_;
  FitTimes times_;
};

// A state as a safetensors file: the cloud, Adam's moments, what densification gathered and the filter, exactly where
// there are any; in the metadata
// the step, `settings`, a JSON object of what the fit depends on, and a checksum. Whole or not at all; replaces an
// older one.
Status WriteFitCheckpoint(const std::filesystem::path& path, const FitState& state, const std::string& settings);

// Whether the file says that it is such a checkpoint, of this version or the one before it; false when it cannot be
// read.
bool IsFitCheckpoint(const std::filesystem::path& path);

// Takes away such a checkpoint if it is there. Nothing else is.
void RemoveFitCheckpoint(const std::filesystem::path& path);

// Those of the `left` files of such a checkpoint that are still as NoteFilesLeft found them: another file of the name,
// or one that was written to since, is none of the run's business. Nothing when the checkpoint cannot be read.
std::vector<std::string> FilesLeftWith(const std::filesystem::path& checkpoint);

// Once they are written: puts down in the checkpoint which files the `left` ones are. Errors: it cannot be read or
// written; then none of them counts as left.
Status NoteFilesLeft(const std::filesystem::path& checkpoint);

// What a file is called for `left`: its absolute path, without "..", as printable text.
std::string AbsoluteName(const std::filesystem::path& file);

// Errors: those of TensorFile; kBadFile when it is no such checkpoint, one of an earlier version or a damaged one;
// kBadArgument when its settings are others than `settings`, naming the first that differs.
Result<FitState> ReadFitCheckpoint(const std::filesystem::path& path, const std::string& settings);

}  // namespace anchorsplat
