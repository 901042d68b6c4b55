#pragma once

#include <string>

namespace anchorsplat {

// Converts ASCII letters to lower case; others differ between encodings.
inline std::string AsciiLowerCase(std::string text) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

}  // namespace anchorsplat
