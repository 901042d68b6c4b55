#pragma once

#include <string>

namespace anchorsplat {

// UTF-8 with letters apart from their marks, as macOS has file names (Unicode's form NFD): "ü" as "u" and U+0308. Of
// Latin, Greek, Cyrillic, Japanese and Korean letters, for comparing names that came from different systems; all other
// bytes stay as they are, UTF-8 or not.
std::string Decomposed(const std::string& text);

}  // namespace anchorsplat
