#pragma once

#include <cstdint>

#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// Every Gaussian becomes `copies` smaller ones that together stand for it, so that an optimisation has something to
// draw detail with. They lie at random places within it, normally distributed with `spread` of its standard deviations
// along its axes, and all axes are shorter by √copies to the power of `shrink`. Opacity and colours stay.
//
// What they show at first is worse than the original; after some steps it is better.
struct SplitOptions {
  int copies = 4;  // K ≥ 1
  double spread = 0.7;
  double shrink = 0.8;
  uint64_t seed = 0;
};

// Row i of `cloud` becomes rows i·K … i·K + K − 1. kBadArgument: copies below 1 or more than 2^31 rows, a negative
// spread or shrink.
Result<GaussianCloud> SplitGaussians(const GaussianCloud& cloud, const SplitOptions& options);

}  // namespace anchorsplat
