#include "core/text.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "core/utf8.h"

namespace anchorsplat {

std::string WithThousands(int64_t n) {
  std::string digits = std::to_string(n);
  const size_t first = digits[0] == '-' ? 1 : 0;
  for (size_t at = digits.size(); at > first + 3;) {
    at -= 3;
    digits.insert(at, ",");
  }
  return digits;
}

std::string Fixed(double value, int digits) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  char text[400];  // longest double in %f: 309 digits and a fraction
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::string HumanBytes(uint64_t bytes) {
  static constexpr const char* kUnits[] = {"B", "kB", "MB", "GB", "TB", "PB", "EB"};
  double value = static_cast<double>(bytes);
  size_t unit = 0;
  while (value >= 999.5 && unit + 1 < std::size(kUnits)) {
    value /= 1000;
    ++unit;
  }
  return Fixed(value, unit == 0 || value >= 99.5 ? 0 : 1) + " " + kUnits[unit];
}

std::string HumanSeconds(double seconds) {
  if (seconds < 0.9995) return Fixed(seconds * 1000, seconds < 0.00995 ? 2 : 0) + " ms";
  if (seconds < 119.5) return Fixed(seconds, 1) + " s";
  const int64_t whole = std::llround(seconds);
  char text[64];
  std::snprintf(text, sizeof text, "%lld min %02lld s", static_cast<long long>(whole / 60),
                static_cast<long long>(whole % 60));
  return text;
}

namespace {
// Characters that change text direction (Unicode Bidi_Control): they can make a line read as another one.
bool TurnsText(std::string_view character) {
  if (character == "\xd8\x9c") return true;  // U+061C
  if (character.size() != 3 || character[0] != '\xe2') return false;
  const auto last = static_cast<unsigned char>(character[2]);
  return (character[1] == '\x80' && (last == 0x8e || last == 0x8f || (last >= 0xaa && last <= 0xae))) ||  // U+200E …
         (character[1] == '\x81' && last >= 0xa6 && last <= 0xa9);                                        // U+2066 …
}
}  // namespace

std::string Printable(const std::string& bytes, size_t longest) {
  std::string out;
  std::string_view rest = bytes;
  while (!rest.empty()) {
    if (out.size() >= longest) return out + "…";
    const size_t size = Utf8CharacterSize(rest);
    const auto byte = static_cast<unsigned char>(rest[0]);
    // U+0080 to U+009F are control characters too: terminals treat U+009B as the start of a command.
    const bool control =
        byte < 0x20 || byte == 0x7f || (size == 2 && byte == 0xc2 && static_cast<unsigned char>(rest[1]) < 0xa0);
    const size_t shown = std::max<size_t>(1, size);
    for (const char c : rest.substr(0, shown)) {
      if (size > 0 && !control && !TurnsText(rest.substr(0, shown))) {
        out += c;
      } else {
        char escaped[8];
        std::snprintf(escaped, sizeof escaped, "\\x%02x", static_cast<unsigned char>(c));
        out += escaped;
      }
    }
    rest.remove_prefix(shown);
  }
  return out;
}

}  // namespace anchorsplat
