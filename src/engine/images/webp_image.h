#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/buffer.h"
#include "core/image.h"
#include "core/result.h"
#include "images/image_io.h"

namespace anchorsplat {

// Four bytes per pixel that mean numbers, not colours.
struct ByteImage {
  int width = 0, height = 0;
  Buffer<uint8_t> rgba;  // [height, width, 4]

  int64_t pixels() const { return int64_t{width} * height; }
};

// Lossless WebP; colours of pixels with alpha 0 are kept. Sides of 1–16,383.
// The image is let go as soon as the encoder has its own copy.
Result<std::string> EncodeWebp(ByteImage image);

// `where` begins messages. Errors (kBadFile): no WebP, damaged, fewer than `min_pixels` or more than `max_pixels`
// (checked before anything is allocated).
Result<ByteImage> DecodeWebp(const std::string& where, std::string_view bytes, int64_t min_pixels, int64_t max_pixels);

// A photograph, as ReadImage gives it (images/image_io.h): three channels, or four where the file has alpha; its size
// and EXIF's orientation. Errors (kBadFile): as above, and for an animation.
Result<Image> DecodeWebpPhotograph(const std::string& where, std::string_view bytes);
Result<ImageSize> DecodeWebpSize(const std::string& where, std::string_view bytes);

}  // namespace anchorsplat
