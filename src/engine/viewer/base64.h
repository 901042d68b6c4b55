#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace anchorsplat {

// Base64 of RFC 4648, padded, on one line.
std::string Base64(std::span<const uint8_t> bytes);

}  // namespace anchorsplat
