#pragma once

#include <cstdint>
#include <string_view>

#include "core/buffer.h"
#include "core/image.h"

namespace anchorsplat {

// EXIF's orientation, 1 to 8, in a TIFF block as it stands in a JPEG's APP1 behind "Exif\0\0" and in a PNG's eXIf
// (EXIF 2.32, tag 0x0112 of the first directory). 1, as it is, for whatever is damaged or says nothing.
int OrientationOfExif(std::string_view tiff);

// Whether rows and columns change places.
inline bool SwapsSides(int orientation) { return orientation >= 5 && orientation <= 8; }

// The picture as it is meant to be seen. Orientations out of 1 to 8 are 1.
Image Upright(Image image, int orientation);
// Of something else with a value per pixel, [height,width] as stored.
Buffer<uint8_t> Upright(const Buffer<uint8_t>& values, int width, int height, int orientation);

}  // namespace anchorsplat
