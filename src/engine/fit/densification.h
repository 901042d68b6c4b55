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

inline constexpr int64_t kStandardSteps = 30000;  // steps for which all published schedules are given

// When all opacities are reduced. Versions of gsplat differ without documenting it.
enum class OpacityReset {
  kPositive,  // at every positive multiple of reset_every: gsplat's main branch since August 2025, and Kerbl et al.
  kFromZero,  // at step 0 too, so that Gaussians begin at 0.01 and not at 0.1: gsplat up to 1.5.2
  kNever,     // gsplat 1.5.3, where the condition cannot become true
};

// Adaptive density control of Kerbl et al. 2023 as in gsplat's DefaultStrategy, with its names. Step counts refer to
// 30,000 steps (ScaledTo).
struct DensificationOptions {
  double prune_opa = 0.005;              // prunes below this opacity; resets reduce opacities to twice this
  double grow_grad2d = 0.0002;           // grows above this mean gradient of the projected centre, in half pictures
  double grow_scale3d = 0.01;            // × scene scale: duplicates up to this largest axis, splits beyond
  double grow_scale2d = 0.05;            // of the larger picture side: splits above this radius, whatever the gradient
  double prune_scale3d = 0.1;            // × scene scale: prunes above this largest axis, after the first reset
  double prune_scale2d = 0.15;           // of the larger picture side: prunes above this radius, after the first reset
  int64_t refine_scale2d_stop_iter = 0;  // both 2-D rules apply before this step; 0: never
  int64_t refine_start_iter = 500;       // grows and prunes after this step …
  int64_t refine_stop_iter = 15000;      // … and before this one, which also ends resets
  int64_t refine_every = 100;
  int64_t reset_every = 3000;
  int64_t pause_refine_after_reset = 0;
  bool absgrad = false;          // uses CloudGradient::means2d_abs (Ye et al. 2024); see kAbsgradGrowGrad2d
  bool revised_opacity = false;  // gives halves of a split opacity 1 − √(1 − o) (Rota Bulò et al. 2024)
  OpacityReset opacity_reset = OpacityReset::kPositive;
  // Growth stops at this number, largest gradients first; a larger start is cut to it when growth ends (Fitter). 0 = no
  // limit. Not in gsplat.
  int64_t max_gaussians = 0;
};

// Threshold grow_grad2d that gsplat recommends with absgrad.
inline constexpr double kAbsgradGrowGrad2d = 0.0008;

// The schedule for another number of steps, like gsplat's steps_scaler = steps/30000, but at least 1 for counts that
// divide.
DensificationOptions ScaledTo(const DensificationOptions& options, int64_t steps);

// What a strategy did after a step. The caller must change the rows of its other per-Gaussian data.
struct DensificationChange {
  RowChange rows;
  bool resets_opacities = false;                  // the caller must call CapOpacities
  Buffer<int64_t> forgotten;                      // rows (before `rows`) that stay but moved: their moments are invalid
  int64_t duplicated = 0, split = 0, pruned = 0;  // of Densification
  int64_t relocated = 0, added = 0;               // of McmcAfterStep
};

// A row to add: a copy of `source`, or one of its halves.
struct Newcomer {
  int64_t source;
  bool half;
  float offset[3];  // from the source's mean, world
};

// What a refinement will do with a cloud's rows. `change.rows.fresh` are the newcomers, in this order.
struct RefinementPlan {
  DensificationChange change;
  std::vector<Newcomer> newcomers;
};

// Values in which a newcomer differs from its source, a row of `cloud`.
struct NewcomerShape {
  std::array<float, 3> log_scales;
  float opacity_logit;
};
NewcomerShape ShapeOf(const DensificationOptions& options, const Newcomer& newcomer, const GaussianCloud& cloud);

class Densification {
 public:
  Densification() = default;
  explicit Densification(int64_t gaussians) { Clear(gaussians); }

  // DefaultStrategy after optimizer step `step` (0, 1, …): accumulates gradients of the centres and, when due,
  // duplicates, splits and prunes `cloud` and requests opacity resets. `gradient`: of this step, for a picture of width
  // × height pixels. Also prunes non-finite rows (IsUsable). The noise of splits depends on seed and step only. `far`:
  // scales thresholds in scene scales.
  DensificationChange AfterStep(const DensificationOptions& options, int64_t step, double scene_scale, uint64_t seed,
                                int width, int height, const CloudGradient& gradient, GaussianCloud& cloud,
                                const FarUnits& far = {});

  // The same in parts, for gradients accumulated elsewhere: whether this step accumulates, refines or resets, and what
  // follows. Plan reads `usable` [N] (IsUsable) and no coefficients of `cloud`.
  static bool Gathers(const DensificationOptions& options, int64_t step) { return step < options.refine_stop_iter; }
  static bool Refines(const DensificationOptions& options, int64_t step);
  static bool ResetsOpacities(const DensificationOptions& options, int64_t step);
  DensificationChange AfterGathering(const DensificationOptions& options, int64_t step, double scene_scale,
                                     uint64_t seed, GaussianCloud& cloud, const FarUnits& far = {});
  RefinementPlan Plan(const DensificationOptions& options, int64_t step, double scene_scale, uint64_t seed,
                      const FarUnits& far, const GaussianCloud& cloud, std::span<const uint8_t> usable) const;

  // For checkpoints: sums since the last change, [N] each.
  struct Gathered {
    Buffer<float> grad2d;  // Σ ‖∂L/∂mean2d‖ in half pictures
    Buffer<float> count;   // steps in which the Gaussian was visible
    Buffer<float> radii;   // largest radius relative to the larger picture side
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

// Limits opacities to `opacity`.
void CapOpacities(GaussianCloud& cloud, double opacity);

}  // namespace anchorsplat
