#pragma once

#include <cstddef>
#include <string_view>

namespace anchorsplat {

// Bytes of the well-formed UTF-8 character that `text` begins with (Unicode 15, table 3-7: no surrogates, nothing
// overlong); 0 where it begins with none, or is empty.
size_t Utf8CharacterSize(std::string_view text);

// True when all of the bytes are well-formed UTF-8.
bool IsUtf8(std::string_view text);

}  // namespace anchorsplat
