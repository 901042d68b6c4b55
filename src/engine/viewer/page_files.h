#pragma once

#include <string_view>

namespace anchorsplat {

// The text of a file of page/, as it was when the program was built; empty for a name that is not there.
std::string_view PageFile(std::string_view name);

}  // namespace anchorsplat
