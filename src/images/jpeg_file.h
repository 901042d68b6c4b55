#pragma once

#include <cstdint>
#include <cstdio>
#include <string>

#include "core/image.h"
#include "core/result.h"
#include "images/image_io.h"

namespace anchorsplat {

// The JPEG side of image_io.h. `file` stands at its first byte; `name` is for messages, `bytes` the file's length.
// Pixels are as stored: an EXIF orientation is not applied, as camera files count in stored pixels.
Result<Image> DecodeJpeg(std::FILE* file, const std::string& name, uint64_t bytes);
Result<ImageSize> DecodeJpegSize(std::FILE* file, const std::string& name, uint64_t bytes);

}  // namespace anchorsplat
