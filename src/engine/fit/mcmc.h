#pragma once

#include <cstdint>

#include "core/gaussian_cloud.h"
#include "fit/densification.h"
#include "fit/far_units.h"

namespace anchorsplat {

// 3D Gaussian Splatting as Markov Chain Monte Carlo (Kheradmand et al. 2024, arXiv:2404.09591) as in gsplat's
// MCMCStrategy, with its names. Gaussians are samples: transparent ones are relocated to others, and noise makes them
// explore. Nothing is split, cloned, pruned or reset. Step counts refer to 30,000 steps (ScaledTo).
struct McmcOptions {
  int64_t cap_max =
      1'000'000;          // Gaussians at which growth stops; a larger start is cut to it when growth ends (Fitter)
  double noise_lr = 5e5;  // noise, × the rate of the means
  int64_t refine_start_iter = 500;    // relocates and grows after this step …
  int64_t refine_stop_iter = 25'000;  // … and before this one. Noise never stops
  int64_t refine_every = 100;
  double min_opacity = 0.005;  // Gaussians at or below this are dead: they are relocated
};

// The schedule for another number of steps, as ScaledTo(DensificationOptions).
McmcOptions ScaledTo(const McmcOptions& options, int64_t steps);

// init_opa and init_scale of gsplat's preset "mcmc" (InitialCloudOptions).
inline constexpr double kMcmcInitialOpacity = 0.5, kMcmcInitialScale = 0.1;
inline constexpr double kMcmcInitialScaleOfFiltered = 0.3;  // with Mip-Splatting's 3-D filter; not in gsplat

// Input of McmcAfterStep besides the options.
struct McmcStep {
  int64_t step = 0;       // 0, 1, …
  double means_rate = 0;  // of the means' next step, world units
  // World units per gsplat unit: its trainer scales the world so that cameras are 1 away from their centre. Noise is
  // proportional to covariance × rate, that is length³, so without this a fit would depend on the project's units.
  double unit = 1;
  uint64_t seed = 0;
  FarUnits far = {};  // scales rate and unit of the noise
};

// MCMCStrategy after an optimizer step. When due, relocates dead Gaussians (`forgotten` lists them and their targets)
// and adds 5 % while there are fewer than cap_max. Then adds noise to all means. Random draws depend on seed and step
// only, so there is no state, and the bits are the same for any number of threads.
//
// Unlike gsplat: moments of relocated Gaussians are reset too (gsplat resets only those of their targets); Gaussians
// with non-finite values are dead; clouds below 20, of which 5 % is none, grow by one.
DensificationChange McmcAfterStep(const McmcOptions& options, const McmcStep& step, GaussianCloud& cloud);

// Shape of each of `ratio` Gaussians at one place that together look like one of `opacity` (eq. 9):
//   o' = 1 − (1 − o)^(1/N),   s' = s · o / Σ_{i=1}^{N} Σ_{k=0}^{i−1} C(i−1, k) (−1)^k o'^(k+1) / √(k+1).
// The sum is the integral of the opacity of N of them along a line through their centre, (1/√π)·∫ 1 − (1 −
// o'·e^(−x²))^N dx, and is computed as such: its terms reach 10^14 and cancel. o' is first clamped, as in gsplat's
// kernel of 2026, to min_opacity and 1 − 2^−23.
struct Relocation {
  double opacity;  // o'
  double scale;    // s'/s
};
inline constexpr int64_t kMostRelocated = 51;  // upper bound of N (n_max)
Relocation RelocationOf(double opacity, int64_t ratio, double min_opacity);

}  // namespace anchorsplat
