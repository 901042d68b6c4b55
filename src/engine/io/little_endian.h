#pragma once

#include <bit>
#include <cstring>
#include <type_traits>

namespace anchorsplat {

// All our binary formats are little-endian, and so is every machine we build for; values are taken over byte for byte.
static_assert(std::endian::native == std::endian::little);

// The number of type T at an address of any alignment.
template <typename T>
T LoadLittle(const void* at) {
  static_assert(std::is_arithmetic_v<T>);
  T value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

}  // namespace anchorsplat
