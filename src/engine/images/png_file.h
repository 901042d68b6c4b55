#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

#include "core/image.h"
#include "core/result.h"
#include "images/image_io.h"

namespace anchorsplat {

// The PNG side of image_io.h. `file` stands at its first byte; `name` is for messages, `bytes` the file's length.
Result<Image> DecodePng(std::FILE* file, const std::string& name, uint64_t bytes);
Result<ImageSize> DecodePngSize(std::FILE* file, const std::string& name, uint64_t bytes);

// 8-bit PNG of an image with 1, 3 or 4 channels; marked as a `rendering` where it is one, with a `comment` in ASCII
// where there is one.
Result<std::string> EncodePng(const Image& image, bool rendering = false, const std::string& comment = {});

// Whether the first bytes of a file are those of a PNG that EncodePng marked as a rendering.
bool IsMarkedAsRendering(std::string_view head);

}  // namespace anchorsplat
