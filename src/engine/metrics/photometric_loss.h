#pragma once

#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// Where SSIM's 11×11 window reaches over the border of the picture.
enum class SsimPadding {
  kSame,   // the picture goes on with zeros, every pixel counts: as the metric (metrics/image_metrics.h)
  kValid,  // pixels nearer than 5 to the border do not count: as gsplat's trainer (fused-ssim's "valid")
};

struct PhotometricLossOptions {
  double ssim_weight = 0.2;  // 0 to 1
  SsimPadding padding = SsimPadding::kValid;
};

// (1 − w)·L1 + w·(1 − SSIM) of Kerbl et al. 2023, with L1 the mean absolute difference over pixels and three channels.
struct PhotometricLossValue {
  double loss = 0;
  double l1 = 0;
  double ssim = 1;
};

// The loss of 3DGS fits and, in the same call, its gradient: `gradient` becomes ∂loss/∂rendered [3,H,W] within `box`
// and is 0 outside of it, where it is not written.
//
// Where all pixels under a window are equal in both pictures, SSIM is 1 and its gradient 0. So the work is confined to
// a box around the pixels that differ, which leaves out the background around an object; no approximation.
//
// The result is the same for any number of threads. A pixel that is not a number makes the loss one, too.
//
// Errors (kBadArgument): images that are not of three channels and one size; an SSIM weight outside of [0, 1]; with
// kValid and a weight above 0, a side below 11 pixels.
Result<PhotometricLossValue> PhotometricLoss(const Image& rendered, const Image& target,
                                             const PhotometricLossOptions& options, Image& gradient, PixelBox& box);

// What of that can be said before there are pictures: the errors of sizes (pixels) and options.
Status CheckPhotometricLoss(int width, int height, const PhotometricLossOptions& options);

}  // namespace anchorsplat
