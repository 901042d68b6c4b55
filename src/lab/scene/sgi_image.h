#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// Silicon Graphics picture format (.rgb, .rgba, .sgi, .bw), common for AC3D textures: big-endian, raw or run-length
// encoded, 8 bits (16 bits are cut to the upper 8), 1–4 channels: grey, grey + alpha, rgb, rgba.
struct SgiImage {
  int width = 0;
  int height = 0;
  std::vector<uint8_t> rgba;  // [H,W,4], rows from top to bottom
};

bool IsSgi(std::string_view bytes);

// Errors (kBadFile, starting with `where` and the byte): another format; more than `max_pixels`; rows outside the file
// or of the wrong length.
Result<SgiImage> DecodeSgi(const std::string& where, std::string_view bytes, int64_t max_pixels);

}  // namespace anchorsplat
