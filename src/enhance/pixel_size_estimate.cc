#include "enhance/pixel_size_estimate.h"

#include <algorithm>
#include <cmath>

#include "enhance/pixel_size_features.h"

namespace anchorsplat {

namespace {

// All of these come from 3DGS fits whose pixel size is known (docs/method.md lists them).

// From this fall on (ln of translucent shares, an octave apart) the minimum is believed; below it in proportion, down
// to none at 0, where the splat has no gaps that could tell.
constexpr double kSureFall = 0.08;
// Pixel size in units of the 10 % quantile of the middle axis: a poor guess, since the size of Gaussians follows the
// schedule and caps as much as the pixels, but the best there is for splats without gaps.
constexpr double kOfMiddleAxis = 0.85;
// Towards smaller pixels, which can only give back too little.
constexpr double kLean = 0.95;
// The true value lies within these factors of the estimate: where the minimum is believed, and where it is not.
constexpr double kSureSpread = 1.5, kUnsureSpread = 2.2;

}  // namespace

Result<PixelSizeEstimate> EstimatePixelSize(const GaussianCloud& cloud) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PixelSizeFeatures features, ComputePixelSizeFeatures(cloud));
  const double trust = std::clamp(features.fall / kSureFall, 0.0, 1.0);
  const auto mix = [trust](double sure, double unsure) {
    return std::exp(trust * std::log(sure) + (1 - trust) * std::log(unsure));
  };
  const double size = kLean * mix(features.crispest, kOfMiddleAxis * features.middle_axis);
  const double spread = mix(kSureSpread, kUnsureSpread);
  return PixelSizeEstimate{size, size / spread, size * spread};
}

}  // namespace anchorsplat
