#pragma once

#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// An enlarged picture by cubic convolution (Keys 1981, a = −1/2, as Pillow and MATLAB have it): pixel areas stay where
// they are (pixel centres at +0.5), rows and columns beyond the border repeat it. Values may leave their range beside
// edges; clamp them. kBadArgument: an empty picture, a size smaller than the picture's own or too large.
Result<Image> EnlargeBicubic(const Image& image, int width, int height);

}  // namespace anchorsplat
