#include "viewer/base64.h"

namespace anchorsplat {

std::string Base64(std::span<const uint8_t> bytes) {
  static constexpr char kAlphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text((bytes.size() + 2) / 3 * 4, '=');
  size_t out = 0;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const size_t left = bytes.size() - i;
    const uint32_t bits = static_cast<uint32_t>(bytes[i]) << 16 |
                          (left > 1 ? static_cast<uint32_t>(bytes[i + 1]) << 8 : 0) |
                          (left > 2 ? static_cast<uint32_t>(bytes[i + 2]) : 0);
    text[out] = kAlphabet[bits >> 18];
    text[out + 1] = kAlphabet[bits >> 12 & 63];
    if (left > 1) text[out + 2] = kAlphabet[bits >> 6 & 63];
    if (left > 2) text[out + 3] = kAlphabet[bits & 63];
    out += 4;
  }
  return text;
}

}  // namespace anchorsplat
