#pragma once

#include <string>
#include <string_view>

#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// ReadImage (images/image_io.h) of bytes that are in memory; `name` is what messages call them. Errors: kBadFile.
Result<Image> DecodeImage(const std::string& name, std::string_view bytes);

}  // namespace anchorsplat
