#include "formats/utf8.h"

#include <cstddef>

namespace anchorsplat {

bool IsUtf8(std::string_view text) {
  size_t i = 0;
  while (i < text.size()) {
    const auto lead = static_cast<unsigned char>(text[i]);
    const size_t length = lead < 0x80 ? 1 : lead >= 0xc2 && lead < 0xe0 ? 2 : lead >= 0xe0 && lead < 0xf0 ? 3 : 4;
    if (length == 4 && (lead < 0xf0 || lead > 0xf4)) return false;
    if (length > text.size() - i) return false;
    for (size_t j = 1; j < length; ++j) {
      const auto byte = static_cast<unsigned char>(text[i + j]);
      const unsigned char lowest = j == 1 && lead == 0xe0 ? 0xa0 : j == 1 && lead == 0xf0 ? 0x90 : 0x80;
      const unsigned char highest = j == 1 && lead == 0xed ? 0x9f : j == 1 && lead == 0xf4 ? 0x8f : 0xbf;
      if (byte < lowest || byte > highest) return false;
    }
    i += length;
  }
  return true;
}

}  // namespace anchorsplat
