#pragma once

#include "core/cloud_view.h"
#include "core/result.h"

namespace anchorsplat {

// Visible loss of a conversion: PSNR between renderings of both clouds.
struct ConversionLoss {
  int views = 0;
  double mean_psnr = 0;  // dB, from the mean squared error over all views; infinite if unchanged
  double min_psnr = 0;   // dB, of the worst view
};

// Renders both clouds at 400 × 400 pixels from `views` cameras around `before`, at the framing distance
// (core/framing.h), on black, clamped to 0–1, each in its render mode or, if it has none, the other's. The order of
// Gaussians does not matter. kBadArgument: views < 1, invalid clouds.
Result<ConversionLoss> MeasureConversionLoss(const CloudView& before, const CloudView& after, int views);

}  // namespace anchorsplat
