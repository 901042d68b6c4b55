#pragma once

#include <cstdint>
#include <string>

#include "core/result.h"
#include "scene/mesh.h"

namespace anchorsplat {

// Decodes a picture by content: PNG, JPEG, WebP, SGI, BMP, or Targa (which has no signature, so its name must end in
// .tga). Grey becomes rgb, 16 bits become 8. `name` becomes Texture::name and starts messages.
// Errors (kBadFile): another format, damaged, more than `max_pixels`.
Result<Texture> DecodeTexture(const std::string& name, const std::string& bytes, int64_t max_pixels);

}  // namespace anchorsplat
