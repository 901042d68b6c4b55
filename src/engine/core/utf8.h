#pragma once

#include <cstddef>
#include <string_view>

namespace anchorsplat {

// Size in bytes of the well-formed UTF-8 character that `text` begins with (Unicode 15, table 3-7: no surrogates,
// nothing overlong); 0 if it begins with none or is empty.
size_t Utf8CharacterSize(std::string_view text);

// Whether `text` is well-formed UTF-8.
bool IsUtf8(std::string_view text);

}  // namespace anchorsplat
