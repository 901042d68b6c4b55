#pragma once

#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// Peak signal-to-noise ratio in dB over all pixels of the first three channels, peak 1: −10·log10(MSE). Infinite for
// identical images. Values are used as given (clamp renders first). kBadArgument: sizes or channels differ.
Result<double> Psnr(const Image& a, const Image& b);

// Mean structural similarity (Wang et al. 2004) over pixels and the three channels: 11×11 Gaussian window, σ 1.5, zero
// padding ("same"), C1 = 0.01², C2 = 0.03². Deterministic for any number of threads. kBadArgument as above.
Result<double> Ssim(const Image& a, const Image& b);

// max(0, min(1, x)) everywhere.
void Clamp01(Image& image);

}  // namespace anchorsplat
