#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// Peak signal-to-noise ratio in dB over all pixels of the first three channels, peak 1: −10·log10(MSE). Infinite for
// identical images. Clamp renderings first. kBadArgument: sizes or channels differ.
Result<double> Psnr(const Image& a, const Image& b);

// Mean structural similarity (Wang et al. 2004) over pixels and three channels: 11×11 Gaussian window, σ 1.5, zero
// padding ("same"), C1 = 0.01², C2 = 0.03². Deterministic for any number of threads. Errors as above.
Result<double> Ssim(const Image& a, const Image& b);

// Quality over the pixels that count.
struct MaskedQuality {
  int64_t counted = 0;  // pixels; 0: nothing was measured
  double psnr = 0;      // dB
  double ssim = 0;      // mean of the SSIM map over them
};

// PSNR and SSIM over the pixels with `ignored` ([H,W]) 0; empty: all. Ignored pixels must be equal in both images, as
// FillIgnored makes them, so that windows that reach into them see no difference. kBadArgument: as above; `ignored` has
// another size.
Result<MaskedQuality> MeasureMasked(const Image& a, const Image& b, std::span<const uint8_t> ignored);

// Message about views left out because they are fully masked: `names`, of `count` views.
std::string WhollyMasked(std::span<const std::string> names, int64_t count);

// Clamps all values to 0–1.
void Clamp01(Image& image);

// Takes what `shown` has where nothing is asked of `picture`, so that the two do not differ there.
void FillIgnored(const Buffer<uint8_t>& ignored, const Image& shown, Image& picture);

}  // namespace anchorsplat
