#pragma once

#include <array>
#include <cstdint>

#include "core/image.h"
#include "core/result.h"
#include "upscale/upscaler.h"

namespace anchorsplat {

// How the alpha channel is enlarged.
enum class AlphaEnlargement : uint8_t {
  kNetwork,  // as a grey picture, so its edges are as sharp as those of the colours
  kBicubic,  // metrics/bicubic.h
};

struct EnlargeOptions {
  int factor = 0;                               // a power of the network's scale; 0: the scale
  std::array<float, 3> background = {0, 0, 0};  // behind pictures with alpha, sRGB 0–1
  AlphaEnlargement alpha = AlphaEnlargement::kNetwork;
};

// Number of passes of the network for a factor. Errors (kBadArgument): factor is no power of the scale, or above 16.
Result<int> TimesOf(int factor, int scale);

// Enlarges [C,H,W] with 3 or 4 channels to [C,H·factor,W·factor], clamped to 0–1. With alpha, the network sees colours
// over the background, and its result is un-composited with the enlarged alpha: over that background it is the
// network's output, and over others it has no seam. Errors: those of TimesOf and Upscaler::Enlarge.
Result<Image> EnlargePicture(Upscaler& upscaler, const Image& image, const EnlargeOptions& options = {});

}  // namespace anchorsplat
