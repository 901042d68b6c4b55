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

// What the iterations of a refinement depend on, besides the options.
struct RefineProblem {
  RenderOptions render;    // of the splat: mode, background
  double upscale = 4;      // u
  double scene_scale = 1;  // world units; as in fits
  uint64_t seed = 0;
  GaussianCloud fixed = {};  // what the state's last Gaussians are and stay; none: all learn
};

// The iterations of a refinement, one at a time: a view and a window of it, what the candidate shows there when seen
// `upscale` times closer and averaged down to the view's pixels, how far that is from the target, a step of Adam.
// Learning rates are those of fits times options.rate (1 when it is not given), and fall to options.rate_decay of that.
//
// With options.align the pictures' cameras move while it runs, a step of fit/view_pose.h whenever a view is looked at.
//
// The state is that of a fit (fit/fitter.h) and is written and read like one. Same bits for any number of threads.
// Where the run has a GPU it stays there, as that of a Fitter does, unless cameras move.
class Refiner {
 public:
  // Errors (kBadArgument): options that cannot be run, no views, no Gaussians.
  static Result<Refiner> Begin(const RefineOptions& options, const RefineProblem& problem, RefineTargets targets,
                               FitState state);

  // The next step, when the part `done`, 0 to 1, of the run is over. None where the GPU is lost: then step() is that of
  // an older state. Errors: those of RefineTargets and ViewObjective.
  Result<FitStep> Step(double done);

  int64_t step() const { return state_.step; }  // steps done
  int64_t size() const;                         // Gaussians
  // As Fitter's. What is changed counts where the state is at home (MoveOut).
  FitState& state();
  // The state is in host memory from here on. False: the GPU that had it is lost, and it is that of an earlier step.
  bool MoveOut();
  RefineTargets& targets() { return targets_; }
  FitTimes times() const;
  double LastPsnr();  // of what the last step saw against its target, before the step

 private:
  Refiner(const RefineOptions& options, const RefineProblem& problem, RefineTargets targets, FitState state);
  void AdjustTarget(const Image& rendered, double done);
  Status Learn(const ObjectiveOptions& objective, const LearningRates& rates, const Camera& camera, double done);
  Status LearnAway(const ObjectiveOptions& objective, const LearningRates& rates, int64_t view, const PixelBox& window,
                   double done);
  Result<PixelBox> WindowAway(const Camera& view);
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

// The part of a view that a step looks at: all of it, or, where a side is longer than kWindow, a window of that size
// around a Gaussian drawn from seed and step.
inline constexpr int kWindow = 512;
PixelBox ChooseWindow(const Camera& camera, const GaussianCloud& cloud, uint64_t seed, int64_t step);

// The rows of `gaussians` that ChooseWindow tries, in this order, and the window from their means ([rows,3]): for those
// who have to fetch them. None where the view is seen as a whole.
std::vector<int64_t> RowsForWindow(const Camera& camera, int64_t gaussians, uint64_t seed, int64_t step);
PixelBox WindowAround(const Camera& camera, std::span<const float> means);

}  // namespace anchorsplat
