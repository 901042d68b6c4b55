#pragma once

#include <charconv>
#include <system_error>
#include <type_traits>

#ifndef __cpp_lib_to_chars
// libc++ before 20 has no floating-point from_chars.
#include <fast_float/fast_float.h>
#endif

namespace anchorsplat {

// std::from_chars for every arithmetic type and standard library, with identical results; `value` is unchanged on
// error.
template <typename T>
std::from_chars_result FromChars(const char* first, const char* last, T& value) {
#ifndef __cpp_lib_to_chars
  if constexpr (std::is_floating_point_v<T>) {
    T parsed{};
    const auto [end, code] = fast_float::from_chars(first, last, parsed);
    if (code == std::errc()) value = parsed;
    return {end, code};
  } else {
    return std::from_chars(first, last, value);
  }
#else
  return std::from_chars(first, last, value);
#endif
}

}  // namespace anchorsplat
