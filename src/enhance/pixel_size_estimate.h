#pragma once

#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// An estimate of p_LR, the world size of a training pixel, from the cloud alone. The true value lies between `low` and
// `high` for nearly all fits it was checked on (docs/method.md); they are far apart when the splat has little to say.
// `size` already leans to the small side of the middle: too small a pixel only gives back too little width, too large a
// one blurs.
struct PixelSizeEstimate {
  double size = 0;  // world units
  double low = 0;
  double high = 0;
};

// kBadArgument: fewer than 16 usable Gaussians with visible opacity and finite scales: nothing to estimate from.
Result<PixelSizeEstimate> EstimatePixelSize(const GaussianCloud& cloud);

}  // namespace anchorsplat
