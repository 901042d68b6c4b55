#include "enhance/pixel_size_estimate.h"

#include <algorithm>
#include <cmath>

#include "enhance/pixel_size_features.h"

namespace anchorsplat {

namespace {

// All of these come from 3DGS fits whose pixel size is known (docs/method.md lists them).

// The minimum is believed from this fall on (ln of translucent shares, an octave apart), and below it in proportion,
// down to none at 0, where the splat has no gaps that could tell.
constexpr double kSureFall = 0.08;
// Up to this translucent share it is believed, and not at all from the second on: there most of the splat is
// translucent whatever the pixels, as dark parts fitted over a black background are.
constexpr double kSureShare = 0.04, kUnsureShare = 0.08;
// Pixel size in units of √(largest × middle axis), of their 10 % quantiles: a poor guess, since the size of Gaussians
// follows the schedule and caps as much as the pixels, but the best there is where the minimum says nothing.
constexpr double kOfAxes = 0.65;
// Towards smaller pixels, which can only give back too little.
constexpr double kLean = 0.95;
// The true value lies within these factors of the estimate: where the minimum is believed, and where it is not.
constexpr double kSureSpread = 1.5, kUnsureSpread = 2.2;

}  // namespace

Result<PixelSizeEstimate> EstimatePixelSize(const GaussianCloud& cloud) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PixelSizeFeatures features, ComputePixelSizeFeatures(cloud));
  const double trust = std::clamp(features.fall / kSureFall, 0.0, 1.0) *
                       std::clamp((kUnsureShare - features.share) / (kUnsureShare - kSureShare), 0.0, 1.0);
  const auto mix = [trust](double sure, double unsure) {
    return std::exp(trust * std::log(sure) + (1 - trust) * std::log(unsure));
  };
  const double size = kLean * mix(features.crispest, kOfAxes * std::sqrt(features.middle_axis * features.largest_axis));
  const double spread = mix(kSureSpread, kUnsureSpread);
  return PixelSizeEstimate{size, size / spread, size * spread};
}

}  // namespace anchorsplat
