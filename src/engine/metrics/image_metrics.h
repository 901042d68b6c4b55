#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// Peak signal-to-noise ratio in dB over all pixels of the first three channels, peak 1: −10·log10(MSE). Infinite for
// identical images. Values are used as given (clamp renders first). kBadArgument: sizes or channels differ.
Result<double> Psnr(const Image& a, const Image& b);

// Mean structural similarity (Wang et al. 2004) over pixels and the three channels: 11×11 Gaussian window, σ 1.5, zero
// padding ("same"), C1 = 0.01², C2 = 0.03². Deterministic for any number of threads. kBadArgument as above.
Result<double> Ssim(const Image& a, const Image& b);

// Of the pixels of a view that count.
struct MaskedQuality {
  int64_t counted = 0;  // pixels; 0: nothing was measured
  double psnr = 0;      // dB
  double ssim = 0;      // mean of the map of Ssim over them
};

// The same two over the pixels whose `ignored` ([H,W]) is 0; empty: all. What is ignored has to be the same in both
// pictures, as FillIgnored makes it, so that the windows of others see no difference there.
// kBadArgument as above, or `ignored` is of another size.
Result<MaskedQuality> MeasureMasked(const Image& a, const Image& b, std::span<const uint8_t> ignored);

// What to say of views that are left out because a mask leaves nothing of them: `names`, of `count` views.
std::string WhollyMasked(std::span<const std::string> names, int64_t count);

// max(0, min(1, x)) everywhere.
void Clamp01(Image& image);

// Takes what `shown` has where nothing is asked of `picture`, so that the two do not differ there.
void FillIgnored(const Buffer<uint8_t>& ignored, const Image& shown, Image& picture);

}  // namespace anchorsplat
