#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "enhance/refine_options.h"
#include "enhance/refine_targets.h"
#include "fit/fitter.h"
#include "fit/residence.h"
#include "fit/view_objective.h"
#include "fit/view_order.h"
#include "fit/view_pose.h"

namespace anchorsplat {

// Input of the iterations besides the options.
struct RefineProblem {
  RenderOptions render;    // of the splat: mode, background
  double upscale = 4;      // u
  double scene_scale = 1;  // world units; as in fits
  uint64_t seed = 0;
  GaussianCloud fixed = {};  // value of the state's last Gaussians, which are not optimised; may be empty
};

// The optimisation loop of a refinement, one step at a time. A step renders a window of a view `upscale` times closer,
// averages it down to the view's pixels, compares it with the target and takes a step of Adam. Learning rates are those
// of fits times options.rate (default 1), falling to options.rate_decay of that.
//
// With options.align, visiting a view also takes a step on its camera (fit/view_pose.h).
//
// The state is that of a fit (fit/fitter.h), with the same file format. It lives on the run's GPU, if any, as in
// Fitter, unless cameras are aligned. The same bits for any number of threads.
class Refiner {
 public:
  // Errors (kBadArgument): invalid options; no views; no Gaussians.
  static Result<Refiner> Begin(const RefineOptions& options, const RefineProblem& problem, RefineTargets targets,
                               FitState state);

  // Runs the next step. `done`: elapsed share of the run, 0–1. If the GPU is lost, no step is made and step() returns
  // to that of an older state. Errors: those of RefineTargets and ViewObjective.
  Result<FitStep> Step(double done);

  int64_t step() const { return state_.step; }  // steps done
  int64_t size() const;                         // Gaussians
  // As Fitter::state(). Changes take effect only while the state is in host memory (MoveToHost).
  FitState& state();
  // Moves the state to host memory. False: the GPU was lost, and the state is that of an earlier step.
  bool MoveToHost();
  RefineTargets& targets() { return targets_; }
  FitTimes times() const;
  double LastPsnr();  // dB, of the last step's render against its target, before the step

 private:
  Refiner(const RefineOptions& options, const RefineProblem& problem, RefineTargets targets, FitState state);
  void AdjustTarget(const Image& rendered, double done);
  Status Learn(const ObjectiveOptions& objective, const LearningRates& rates, const Camera& camera, double done);
  Status LearnOnGpu(const ObjectiveOptions& objective, const LearningRates& rates, int64_t view, const PixelBox& window,
                    double done);
  Result<PixelBox> WindowOnGpu(const Camera& view);
  Result<Camera> AlignedView(int64_t view, const PixelBox& window);

  RefineOptions options_;
  RefineProblem problem_;
  RefineTargets targets_;
  FitState state_;
  ViewOrder order_;
  ViewObjective objective_;
  CloudGradient gradient_;
  RefineTarget target_;
  PoseAligner aligner_;
  Residence residence_;
  FitTimes times_;
};

// The window of a view that a step uses: the whole view, or, if a side exceeds kWindow, a window of that size around a
// Gaussian drawn from seed and step.
inline constexpr int kWindow = 512;
PixelBox ChooseWindow(const Camera& camera, const GaussianCloud& cloud, uint64_t seed, int64_t step);

// The rows of Gaussians that ChooseWindow tries in turn, and the window for their means ([rows,3]): for callers who
// must fetch these. No rows if the view is used whole.
std::vector<int64_t> RowsForWindow(const Camera& camera, int64_t gaussians, uint64_t seed, int64_t step);
PixelBox WindowAround(const Camera& camera, std::span<const float> means);

}  // namespace anchorsplat
