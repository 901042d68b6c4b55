#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/gaussian_cloud.h"
#include "core/image.h"
#include "core/result.h"
#include "fit/cloud_optimizer.h"
#include "fit/densification.h"
#include "fit/fit_options.h"
#include "fit/mip_filter.h"
#include "fit/picture_cache.h"
#include "fit/view_objective.h"
#include "fit/view_order.h"

namespace anchorsplat {

// All that changes during a fit.
struct FitState {
  int64_t step = 0;  // steps done
  GaussianCloud cloud;
  CloudOptimizer optimizer;
  Densification densification;  // of nothing where the strategy gathers nothing
  Buffer<float> mip_filter;     // [N] world units, MipFilterSizes; empty where the fit has no such filter
  // [V,6] of refinements that align their views: how far each has moved from where its camera says (MotionBetween in
  // fit/view_pose.h). Empty: they stay.
  Buffer<float> motions;
  Buffer<float> exposures;  // [V,6] of fits that take them out: gain and bias per channel, as they are measured
  // Files that an interruption leaves besides its checkpoint, by their AbsoluteName: what goes on may replace them.
  std::vector<std::string> left;
};

// Before an interruption writes its results: notes which of these files it will leave besides its checkpoint.
void Leave(FitState& state, std::span<const std::filesystem::path> files);

// What one step saw.
struct FitStep {
  PhotometricLossValue loss;
  int64_t view = 0;
  DensificationChange change;
};

// Seconds on the clock, of all steps so far.
struct FitTimes {
  double load = 0;  // pictures from the cache
  ObjectiveTimes objective;
  double adam = 0, densify = 0;  // the latter with the measuring of filters
};

// The iterations of a fit, one at a time: view, objective, optimizer, densification. The state after k steps is the
// same bits for any number of threads, and whether they were made in one go or from a checkpoint.
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
  const FitState& state() const { return state_; }
  void Leave(std::span<const std::filesystem::path> files) { anchorsplat::Leave(state_, files); }
  const FitOptions& options() const { return options_; }
  PictureCache& pictures() { return pictures_; }
  FitTimes times() const;
  // Peak signal-to-noise ratio of the last step's picture, before the step.
  double LastPsnr() const;
  // A copy of the cloud as it is rendered, the smoothing filter fused, without rows that are not finite.
  GaussianCloud UsableCloud() const;

 private:
  Fitter(const FitOptions& options, PictureCache pictures, double scene_scale, FitState state);

  DensificationChange ChangeGaussians(const Camera& rays);
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
