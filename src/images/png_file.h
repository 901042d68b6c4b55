#pragma once

#include <cstdint>
#include <cstdio>
#include <string>

#include "core/image.h"
#include "core/result.h"
#include "images/image_io.h"

namespace anchorsplat {

// The PNG side of image_io.h. `file` stands at its first byte; `name` is for messages, `bytes` the file's length.
Result<Image> DecodePng(std::FILE* file, const std::string& name, uint64_t bytes);
Result<ImageSize> DecodePngSize(std::FILE* file, const std::string& name, uint64_t bytes);

// 8-bit PNG of an image with 1, 3 or 4 channels.
Result<std::string> EncodePng(const Image& image);

}  // namespace anchorsplat
