#pragma once

#include <string>
#include <string_view>

#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// ReadImage (images/image_io.h) for bytes in memory; `name` is used in messages. Errors: kBadFile.
Result<Image> DecodeImage(const std::string& name, std::string_view bytes);

}  // namespace anchorsplat
