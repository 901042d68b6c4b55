#pragma once

#include <string_view>

namespace anchorsplat {

// Contents of a file of page/, embedded at build time; empty for unknown names.
std::string_view PageFile(std::string_view name);

}  // namespace anchorsplat
