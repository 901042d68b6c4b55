#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

#include "core/image.h"
#include "core/result.h"
#include "images/image_io.h"

namespace anchorsplat {

// JPEG for image_io.h. `file`: at its first byte; `name`: for messages; `bytes`: length of the file. Pixels are as
// stored; the size includes the EXIF orientation.
Result<Image> DecodeJpeg(std::FILE* file, const std::string& name, uint64_t bytes);
Result<ImageSize> DecodeJpegSize(std::FILE* file, const std::string& name, uint64_t bytes);
// The same for a file in memory.
Result<Image> DecodeJpegBytes(std::string_view bytes, const std::string& name);

// Encodes a baseline JPEG with 4:2:0 chroma, as cameras do, from 3 channels: value·255, clamped and rounded to nearest.
// Errors: kBadArgument: other channels, no pixels, sides above 65,500, quality outside 1 to 100; kIo: out of memory.
Result<std::string> EncodeJpeg(const Image& image, int quality);

}  // namespace anchorsplat
