#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

#include "core/image.h"
#include "core/result.h"
#include "images/image_io.h"

namespace anchorsplat {

// PNG for image_io.h. `file`: at its first byte; `name`: for messages; `bytes`: length of the file.
Result<Image> DecodePng(std::FILE* file, const std::string& name, uint64_t bytes);
Result<ImageSize> DecodePngSize(std::FILE* file, const std::string& name, uint64_t bytes);

// Encodes an 8-bit PNG with 1, 3 or 4 channels. `rendering` marks it as one (images/rendering.h); a non-empty `comment`
// is ASCII.
Result<std::string> EncodePng(const Image& image, bool rendering = false, const std::string& comment = {});

// Whether the first bytes of a file are from a PNG that EncodePng marked as a rendering.
bool IsMarkedAsRendering(std::string_view head);

}  // namespace anchorsplat
