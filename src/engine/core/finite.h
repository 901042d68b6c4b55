#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>

namespace anchorsplat {

template <typename T>
bool AllFinite(const T* values, int64_t count) {
  return std::all_of(values, values + count, [](T x) { return std::isfinite(x); });
}

// Of an array, vector or span.
template <typename Values>
bool AllFinite(const Values& values) {
  return AllFinite(std::data(values), std::ssize(values));
}

inline float FiniteOr(float value, float otherwise) { return std::isfinite(value) ? value : otherwise; }

// Clamped to 0–1; `otherwise` if not finite.
inline float UnitOr(float value, float otherwise) {
  return std::isfinite(value) ? std::clamp(value, 0.0f, 1.0f) : otherwise;
}

}  // namespace anchorsplat
