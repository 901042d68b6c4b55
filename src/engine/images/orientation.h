#pragma once

#include <cstdint>
#include <string_view>

#include "core/buffer.h"
#include "core/image.h"

namespace anchorsplat {

// EXIF orientation, 1 to 8, from a TIFF block as in a JPEG's APP1 after "Exif\0\0" and in a PNG's eXIf (EXIF 2.32, tag
// 0x0112 of the first directory). 1 if absent or damaged.
int OrientationOfExif(std::string_view tiff);

// Whether width and height are swapped.
inline bool SwapsSides(int orientation) { return orientation >= 5 && orientation <= 8; }

// Applies the orientation. Values outside 1 to 8 count as 1.
Image Upright(Image image, int orientation);
// The same for one value per pixel, [height,width] as stored.
Buffer<uint8_t> Upright(const Buffer<uint8_t>& values, int width, int height, int orientation);

}  // namespace anchorsplat
