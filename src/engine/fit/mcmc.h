#pragma once

#include <cstdint>

#include "core/gaussian_cloud.h"
#include "fit/densification.h"
#include "fit/far_units.h"

namespace anchorsplat {

// 3D Gaussian Splatting as Markov Chain Monte Carlo (Kheradmand et al. 2024, arXiv:2404.09591) as gsplat's MCMCStrategy
// does it, under its names: Gaussians are samples, those that are transparent move to where others are, noise lets them
// look around, and nothing is split, cloned, pruned or reset. Counts of steps are for 30,000 of them (ScaledTo).
struct McmcOptions {
  int64_t cap_max =
      1'000'000;          // Gaussians: growth stops there. A start with more is cut to it when growth ends (Fitter)
  double noise_lr = 5e5;  // × the rate of the means: of the noise
  int64_t refine_start_iter = 500;    // relocation and growth in steps after this …
  int64_t refine_stop_iter = 25'000;  // … and before this. Noise never stops
  int64_t refine_every = 100;
  double min_opacity = 0.005;  // at or below it a Gaussian is dead: it moves
};

// The same schedule for another number of steps, as ScaledTo of DensificationOptions.
McmcOptions ScaledTo(const McmcOptions& options, int64_t steps);

// What gsplat's trainer calls init_opa and init_scale in its preset "mcmc" (InitialCloudOptions).
inline constexpr double kMcmcInitialOpacity = 0.5, kMcmcInitialScale = 0.1;
inline constexpr double kMcmcInitialScaleOfFiltered = 0.3;  // with Mip-Splatting's 3-D filter, which is not gsplat's

// A step as McmcAfterStep sees it.
struct McmcStep {
  int64_t step = 0;       // 0, 1, …; of all
  double means_rate = 0;  // of the means' next step, world units
  // World units per unit of gsplat's, whose trainer scales the world so that cameras stand 1 away from their middle.
  // Noise is proportional to a covariance and a rate, that is to length³: without this a fit would depend on the units
  // of the project.
  double unit = 1;
  uint64_t seed = 0;
  FarUnits far = {};  // of the noise: rate and unit are as much larger there
};

// What MCMCStrategy does after the optimizer's step: at its times dead Gaussians move (`forgotten` are those and the
// ones they moved to), and 5 % more are born while there are fewer than cap_max; then all means get noise. It gathers
// nothing: seed and step say what is drawn, so that there is no state to keep, and the result has the same bits for any
// number of threads.
//
// Ours: the moments of Gaussians that moved are void, too (gsplat forgets those of their new neighbours only), a
// Gaussian with a value that is not finite is dead, and fewer than 20, 5 % of which are none, grow by one.
DensificationChange McmcAfterStep(const McmcOptions& options, const McmcStep& step, GaussianCloud& cloud);

// What one of `ratio` Gaussians must be so that all of them in one place look like one of `opacity` did (eq. 9):
//   o' = 1 − (1 − o)^(1/N),   s' = s · o / Σ_{i=1}^{N} Σ_{k=0}^{i−1} C(i−1, k) (−1)^k o'^(k+1) / √(k+1).
// The sum is the integral of what N of them cover along a line through their centre, (1/√π)·∫ 1 − (1 − o'·e^(−x²))^N
// dx, and is calculated as that: its own terms are as large as 10^14 and cancel. o' is bounded first, as in gsplat's
// kernel of 2026: to min_opacity and 1 − 2^−23.
struct Relocation {
  double opacity;  // o'
  double scale;    // s'/s
};
inline constexpr int64_t kMostRelocated = 51;  // N is bounded to this (n_max)
Relocation RelocationOf(double opacity, int64_t ratio, double min_opacity);

}  // namespace anchorsplat
