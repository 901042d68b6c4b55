#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/image.h"
#include "formats/png_file.h"

namespace anchorsplat {

// For tests: small files in memory.

inline std::string PngBytes(const Image& image) { return EncodePng(image).value(); }

inline std::string Base64(const std::string& bytes) {
  constexpr const char* kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t three = 0;
    for (size_t k = 0; k < 3; ++k) three = three << 8 | (i + k < bytes.size() ? static_cast<uint8_t>(bytes[i + k]) : 0);
    for (size_t k = 0; k < 4; ++k) out += i + k > bytes.size() ? '=' : kLetters[three >> (18 - 6 * k) & 63];
  }
  return out;
}

// An SGI picture, plain: `values` channel by channel, rows from the bottom.
inline std::string SgiBytes(int width, int height, int channels, const std::vector<uint8_t>& values) {
  std::string out(512, '\0');
  const auto put = [&](size_t at, int value) {
    out[at] = static_cast<char>(value >> 8);
    out[at + 1] = static_cast<char>(value & 255);
  };
  put(0, 474);
  out[3] = 1;
  put(4, 3);
  put(6, width);
  put(8, height);
  put(10, channels);
  out.append(reinterpret_cast<const char*>(values.data()), values.size());
  return out;
}

}  // namespace anchorsplat
