#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/buffer.h"
#include "core/image.h"
#include "core/result.h"
#include "images/image_io.h"

namespace anchorsplat {

// Image of four bytes per pixel, used as numbers, not colours.
struct ByteImage {
  int width = 0, height = 0;
  Buffer<uint8_t> rgba;  // [height, width, 4]

  int64_t pixels() const { return int64_t{width} * height; }
};

// Encodes lossless WebP; colours of pixels with alpha 0 are kept. Sides must be 1–16,383. `image` is freed as soon as
// the encoder has its own copy.
Result<std::string> EncodeWebp(ByteImage image);

// Decodes WebP; `where` starts messages. Errors (kBadFile): not a WebP, damaged, fewer than `min_pixels` or more than
// `max_pixels` (checked before allocation).
Result<ByteImage> DecodeWebp(const std::string& where, std::string_view bytes, int64_t min_pixels, int64_t max_pixels);

// Decodes a WebP photograph as ReadImage does (images/image_io.h): 3 channels, or 4 with alpha; and its size and EXIF
// orientation. Errors (kBadFile): as above; an animation.
Result<Image> DecodeWebpPhotograph(const std::string& where, std::string_view bytes);
Result<ImageSize> DecodeWebpSize(const std::string& where, std::string_view bytes);

}  // namespace anchorsplat
