#pragma once

#include <bit>
#include <cstring>
#include <type_traits>

namespace anchorsplat {

// All our binary formats and target machines are little-endian, so values are copied byte for byte.
static_assert(std::endian::native == std::endian::little);

// Loads a T from an address of any alignment.
template <typename T>
T LoadLittleEndian(const void* at) {
  static_assert(std::is_arithmetic_v<T>);
  T value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

}  // namespace anchorsplat
