#pragma once

#include <string>
#include <string_view>

namespace anchorsplat {

// A WGSL compile error as one sentence: the library's first words on it, and the line of `text` that it points to, if
// any.
std::string ShaderError(const std::string& message, std::string_view text);

}  // namespace anchorsplat
