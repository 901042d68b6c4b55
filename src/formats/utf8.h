#pragma once

#include <string_view>

namespace anchorsplat {

// True when the bytes are well-formed UTF-8 (Unicode 15, table 3-7: no surrogates, nothing overlong).
bool IsUtf8(std::string_view text);

}  // namespace anchorsplat
