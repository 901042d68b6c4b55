#pragma once

#include <string>

namespace anchorsplat {

// Only ASCII: other letters differ between encodings anyway.
inline std::string SmallLetters(std::string text) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

}  // namespace anchorsplat
