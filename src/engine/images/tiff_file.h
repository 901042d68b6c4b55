#pragma once

#include <string>

#include "core/image.h"
#include "core/result.h"
#include "images/image_io.h"

namespace anchorsplat {

// TIFF for image_io.h by libtiff: 8 and 16 bits, grey or rgb, with or without alpha, strips or tiles. The web build
// uses without_tiff/ instead. `name`: for messages; `bytes`: the file. Errors: kBadFile.
Result<Image> DecodeTiff(const std::string& name, std::string bytes);
Result<ImageSize> DecodeTiffSize(const std::string& name, std::string bytes);

}  // namespace anchorsplat
