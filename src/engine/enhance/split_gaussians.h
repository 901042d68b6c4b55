#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// Every Gaussian becomes `copies` smaller ones that together stand for it, so that an optimisation has something to
// draw detail with. They lie at random places within it, normally distributed with `spread` of its standard deviations
// along its axes, and all axes are shorter by √copies to the power of `shrink`. Opacity and colours stay.
//
// With `each`, Gaussian i becomes each[i] instead, whose axes are shorter by √each[i] to the same power; one stays as
// it is.
//
// What they show at first is worse than the original; after some steps it is better.
struct SplitOptions {
  int copies = 4;  // K ≥ 1
  double spread = 0.7;
  double shrink = 0.8;
  uint64_t seed = 0;
  std::span<const int> each = {};  // [N], ≥ 1; empty: `copies` of all
};

// The copies of row i stand behind those of row i − 1. kBadArgument: copies below 1 or more than 2^31 rows, a number of
// `each` that is not that of the Gaussians, a negative spread or shrink.
Result<GaussianCloud> SplitGaussians(const GaussianCloud& cloud, const SplitOptions& options);

// How many copies each Gaussian is to have, `all` together or, where bounds forbid it, nearly so: in proportion to
// the square root of its `residual` (≥ 0), at least 1 and at most kMostShare · copies. Where what is there is right
// already, more Gaussians have nothing to draw.
inline constexpr int kMostShare = 4;
std::vector<int> CopiesByResidual(std::span<const double> residuals, int copies, int64_t all);

}  // namespace anchorsplat
