#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace anchorsplat {

// RFC 4648 with padding, on one line.
std::string Base64(std::span<const uint8_t> bytes);

}  // namespace anchorsplat
