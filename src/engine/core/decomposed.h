#pragma once

#include <string>

namespace anchorsplat {

// Decomposes accented Latin, Greek and Cyrillic letters, Japanese and Korean into base letters and marks (Unicode NFD),
// as macOS stores file names: "ü" becomes "u" and U+0308. For comparing names from different systems. All other bytes
// stay as they are, valid UTF-8 or not.
std::string Decomposed(const std::string& text);

}  // namespace anchorsplat
