#pragma once

#include "core/cloud_view.h"
#include "core/result.h"

namespace anchorsplat {

// What a conversion costs to the eye: PSNR of pictures of both clouds.
struct ConversionLoss {
  int views = 0;
  double mean_psnr = 0;  // dB, of the mean squared error over all views; infinite when nothing changed
  double min_psnr = 0;   // dB, of the worst view
};

// Renders both from `views` places around `before`, at the distance that frames it (core/framing.h), 400 × 400 pixels,
// on black and clamped to 0–1, in the render mode that each cloud says or that of the other. The order of the Gaussians
// does not matter. kBadArgument: views < 1, invalid clouds.
Result<ConversionLoss> MeasureConversionLoss(const CloudView& before, const CloudView& after, int views);

}  // namespace anchorsplat
