#pragma once

#include <array>
#include <cstdint>

#include "core/image.h"
#include "core/result.h"
#include "upscale/upscaler.h"

namespace anchorsplat {

// How the coverage of a picture with an alpha channel is enlarged.
enum class AlphaEnlargement : uint8_t {
  kNetwork,  // as a grey picture: its edges are as sharp as those of the colours
  kBicubic,  // metrics/bicubic.h
};

struct EnlargeOptions {
  int factor = 0;                               // a power of the network's scale; 0: the scale
  std::array<float, 3> background = {0, 0, 0};  // that colours of pictures with alpha are enlarged over, sRGB 0–1
  AlphaEnlargement alpha = AlphaEnlargement::kNetwork;
};

// How often a network is applied for a factor. Errors (kBadArgument): it is no power of the scale, or more than 16.
Result<int> TimesOf(int factor, int scale);

// [C,H,W] of 3 or 4 channels to [C,H·factor,W·factor], within 0 to 1. Of a picture with alpha the network sees the
// colours over the background, and what it makes of them is taken off the background again by the enlarged alpha: over
// that background the result is what the network made, and over others it has no seam. Errors: those of TimesOf and
// Upscaler::Enlarge.
Result<Image> EnlargePicture(Upscaler& upscaler, const Image& image, const EnlargeOptions& options = {});

}  // namespace anchorsplat
