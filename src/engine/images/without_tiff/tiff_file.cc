#include "images/tiff_file.h"

#include <utility>

#include "core/text.h"

namespace anchorsplat {

Result<Image> DecodeTiff(const std::string& name, std::string) {
  return Error{ErrorCode::kBadFile, Cat(name, ": a TIFF, which is not supported here; convert it to PNG or JPEG")};
}

Result<ImageSize> DecodeTiffSize(const std::string& name, std::string bytes) {
  return DecodeTiff(name, std::move(bytes)).error();
}

}  // namespace anchorsplat
