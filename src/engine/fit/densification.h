#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "fit/cloud_optimizer.h"
#include "fit/far_units.h"
#include "render/rasterizer.h"

namespace anchorsplat {

inline constexpr int64_t kStandardSteps = 30000;  // of a fit, for which all published schedules are given

// When all opacities are taken down. gsplat's versions differ here without saying so.
enum class OpacityReset {
  kPositive,  // at every positive multiple of reset_every: gsplat's main branch since August 2025, and Kerbl et al.
  kFromZero,  // at step 0 too, so that Gaussians begin at 0.01 and not at 0.1: gsplat up to 1.5.2
  kNever,     // gsplat 1.5.3, where the condition cannot become true
};

// Adaptive density control of Kerbl et al. 2023 as gsplat's DefaultStrategy does it, under its names. Counts of steps
// are for 30,000 of them (ScaledTo).
struct DensificationOptions {
  double prune_opa = 0.005;     // opacity below which a Gaussian goes; a reset takes opacities down to twice this
  double grow_grad2d = 0.0002;  // mean gradient of the centre in the picture, in half pictures, above which it grows
  double grow_scale3d = 0.01;   // × scene scale: the largest axis up to which it is duplicated, beyond it is split
  double grow_scale2d = 0.05;   // of the larger picture side: radius above which it is split whatever its gradient
  double prune_scale3d = 0.1;   // × scene scale: the largest axis above which it goes, after the first reset
  double prune_scale2d = 0.15;  // of the larger picture side: radius above which it goes, after the first reset
  int64_t refine_scale2d_stop_iter = 0;  // both 2-D rules apply before this step: by default never
  int64_t refine_start_iter = 500;       // growth and pruning in steps after this …
  int64_t refine_stop_iter = 15000;      // … and before this, which ends resets too
  int64_t refine_every = 100;
  int64_t reset_every = 3000;
  int64_t pause_refine_after_reset = 0;
  bool absgrad = false;  // the gradient is that of CloudGradient::means2d_abs (Ye et al. 2024); see kAbsgradGrowGrad2d
  bool revised_opacity = false;  // halves of a split get 1 − √(1 − o) (Rota Bulò et al. 2024)
  OpacityReset opacity_reset = OpacityReset::kPositive;
  int64_t max_gaussians = 0;  // growth stops there, Gaussians with the largest gradients first, and what
                              // began above it is cut to it when growth ends (Fitter); 0 = no bound. Ours
};

// The threshold grow_grad2d that gsplat's DefaultStrategy recommends with absgrad.
inline constexpr double kAbsgradGrowGrad2d = 0.0008;

// The same schedule for another number of steps: what gsplat's steps_scaler = steps/30000 does, but never below 1
// where a count divides.
DensificationOptions ScaledTo(const DensificationOptions& options, int64_t steps);

// What a strategy did after a step. The caller changes the rows of everything else it keeps per Gaussian.
struct DensificationChange {
  RowChange rows;
  bool resets_opacities = false;  // the caller has to (CapOpacities)
  Buffer<int64_t> forgotten;      // rows before `rows` that stay and are somewhere else now: their moments are void
  int64_t duplicated = 0, split = 0, pruned = 0;  // of Densification
  int64_t relocated = 0, added = 0;               // of McmcAfterStep
};

// A row to come: a copy of `source`, or one of its halves.
struct Newcomer {
  int64_t source;
  bool half;
  float offset[3];  // from the source's mean, world
};

// What a refinement is going to do with the rows of a cloud: `change.rows.fresh` are the newcomers, in this order.
struct RefinementPlan {
  DensificationChange change;
  std::vector<Newcomer> newcomers;
};

// What a newcomer has that its source, row of `cloud`, has not.
struct NewcomerShape {
  std::array<float, 3> log_scales;
  float opacity_logit;
};
NewcomerShape ShapeOf(const DensificationOptions& options, const Newcomer& newcomer, const GaussianCloud& cloud);

class Densification {
 public:
  Densification() = default;
  explicit Densification(int64_t gaussians) { Clear(gaussians); }

  // What DefaultStrategy does after the optimizer's step `step` (0, 1, …): gathers the gradients of the centres and,
  // at its times, duplicates, splits and prunes `cloud` and says when opacities are to be taken down to twice
  // prune_opa. `gradient` is that of the step, for a picture of width × height pixels. Rows that are not finite
  // (IsUsable) are pruned with the others. The noise of splits follows from seed and step. Thresholds in scene scales
  // are in `far` units.
  DensificationChange AfterStep(const DensificationOptions& options, int64_t step, double scene_scale, uint64_t seed,
                                int width, int height, const CloudGradient& gradient, GaussianCloud& cloud,
                                const FarUnits& far = {});

  // Its parts, for those who gather elsewhere: whether there is anything to gather at that step, what comes after it,
  // and of that what is done when. Plan looks at `usable` [N] (IsUsable) and not at the coefficients of `cloud`.
  static bool Gathers(const DensificationOptions& options, int64_t step) { return step < options.refine_stop_iter; }
  static bool Refines(const DensificationOptions& options, int64_t step);
  static bool ResetsOpacities(const DensificationOptions& options, int64_t step);
  DensificationChange AfterGathering(const DensificationOptions& options, int64_t step, double scene_scale,
                                     uint64_t seed, GaussianCloud& cloud, const FarUnits& far = {});
  RefinementPlan Plan(const DensificationOptions& options, int64_t step, double scene_scale, uint64_t seed,
                      const FarUnits& far, const GaussianCloud& cloud, std::span<const uint8_t> usable) const;

  // For checkpoints: what was gathered since the last change. [N] each.
  struct Gathered {
    Buffer<float> grad2d;  // Σ ‖∂L/∂mean2d‖ in half pictures
    Buffer<float> count;   // of the steps in which the Gaussian was visible
    Buffer<float> radii;   // largest radius in parts of the larger picture side
  };
  const Gathered& gathered() const { return gathered_; }
  Gathered& gathered() { return gathered_; }

 private:
  void Clear(int64_t gaussians);
  void Gather(bool absgrad, int width, int height, const CloudGradient& gradient);
  DensificationChange Refine(const DensificationOptions& options, int64_t step, double scene_scale, uint64_t seed,
                             const FarUnits& far, GaussianCloud& cloud);

  Gathered gathered_;
};

// Takes opacities down to at most `opacity`.
void CapOpacities(GaussianCloud& cloud, double opacity);

}  // namespace anchorsplat
