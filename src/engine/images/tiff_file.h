#pragma once

#include <string>

#include "core/image.h"
#include "core/result.h"
#include "images/image_io.h"

namespace anchorsplat {

// The TIFF side of image_io.h: 8 and 16 bits, grey and rgb, with alpha or without, in strips or tiles, by libtiff. A
// build for the web has without_tiff/ in the place of with_tiff/. `name` is for messages, `bytes` the file. kBadFile.
Result<Image> DecodeTiff(const std::string& name, std::string bytes);
Result<ImageSize> DecodeTiffSize(const std::string& name, std::string bytes);

}  // namespace anchorsplat
