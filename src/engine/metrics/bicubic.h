#pragma once

#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// Enlarges by cubic convolution (Keys 1981, a = −1/2, as in Pillow and MATLAB), with pixel areas aligned (pixel centres
// at +0.5) and border pixels repeated. Values can overshoot at edges; clamp them. kBadArgument: an empty image, or a
// size smaller than the image or too large.
Result<Image> EnlargeBicubic(const Image& image, int width, int height);

}  // namespace anchorsplat
