#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

#include "core/image.h"
#include "core/result.h"
#include "images/image_io.h"

namespace anchorsplat {

// The JPEG side of image_io.h. `file` stands at its first byte; `name` is for messages, `bytes` the file's length.
// Pixels are as stored; the size comes with EXIF's orientation.
Result<Image> DecodeJpeg(std::FILE* file, const std::string& name, uint64_t bytes);
Result<ImageSize> DecodeJpegSize(std::FILE* file, const std::string& name, uint64_t bytes);
// The same of a file in memory.
Result<Image> DecodeJpegBytes(std::string_view bytes, const std::string& name);

// A baseline JPEG as cameras write it, colours at half the resolution: values·255 rounded to nearest, clamped; 3
// channels. Errors: kBadArgument: other channels, no pixels, sides above 65,500, a quality that is not 1 to 100; kIo:
// no memory.
Result<std::string> EncodeJpeg(const Image& image, int quality);

}  // namespace anchorsplat
