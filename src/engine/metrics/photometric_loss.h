#pragma once

#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// Treatment of SSIM windows that cross the image border.
enum class SsimPadding {
  kSame,   // zero padding, all pixels count: as in metrics/image_metrics.h
  kValid,  // pixels within 5 of the border do not count: as in gsplat's trainer (fused-ssim's "valid")
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

// The loss of 3DGS fits and its gradient: `gradient` receives ∂loss/∂rendered [3,H,W] within `box`. Outside it is 0 and
// not written.
//
// SSIM is 1 and its gradient 0 where all pixels under a window are equal in both images. Work is therefore confined to
// a box around the pixels that differ, which skips the background of an object; this is exact.
//
// Deterministic for any number of threads. A NaN pixel makes the loss NaN.
//
// Errors (kBadArgument): images without three channels or of different size; an SSIM weight outside [0, 1]; with kValid
// and a weight above 0, a side below 11 pixels.
Result<PhotometricLossValue> PhotometricLoss(const Image& rendered, const Image& target,
                                             const PhotometricLossOptions& options, Image& gradient, PixelBox& box);

// Checks sizes (pixels) and options before there are images. Errors as above.
Status CheckPhotometricLoss(int width, int height, const PhotometricLossOptions& options);

}  // namespace anchorsplat
