#pragma once

#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// What a cloud alone says about p_LR, the size of the pixels it was trained at. All lengths are in world units and all
// of them scale with the cloud, so that any combination of degree one does too.
struct PixelSizeFeatures {
  // The pixel size at which the cloud's own alpha is crispest: the smallest translucent share (below). Rendered with
  // 0.3 px² of smaller pixels a fit shows gaps between its eroded Gaussians, with those of larger ones its outlines
  // blur; both make pixels translucent. The size it was optimised for lies near the minimum.
  double crispest = 0;
  double share = 0;  // translucent share there
  double fall = 0;   // ln of the share at half of `crispest` over that at `crispest`: how many gaps there are to close
  double rise = 0;   // ln of the share at twice `crispest` over that at `crispest`: how much outline there is to blur
  // 10 % quantiles over the visible Gaussians, weighted by opacity × area (product of the two larger axes).
  double largest_axis = 0;
  double middle_axis = 0;
};

// Share of the covered area that is translucent when the cloud is rendered with the dilation of pixels of `pixel_size`
// (world units at the middle of the cloud), seen from all sides: pixels with 0.7 < alpha < 0.95 over the sum of alpha.
// The rendered picture itself always has the same resolution; it only samples.
//
// Splats without gaps at any pixel size have no minimum; `fall` is 0 then and `crispest` means nothing.
// Only Gaussians near the middle of the cloud and small beside it are looked at. kBadArgument: fewer than
// kLeastGaussians of them an opacity of 10 % or more and three positive scales.
inline constexpr int64_t kLeastGaussians = 16;
Result<PixelSizeFeatures> ComputePixelSizeFeatures(const GaussianCloud& cloud);

}  // namespace anchorsplat
