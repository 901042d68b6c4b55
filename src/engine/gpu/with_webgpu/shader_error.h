#pragma once

#include <string>
#include <string_view>

namespace anchorsplat {

// What a library says of WGSL that it does not compile, as one sentence: its first words on the error, and the line of
// `text` that it points to, where it names one.
std::string ShaderError(const std::string& message, std::string_view text);

}  // namespace anchorsplat
