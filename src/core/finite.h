#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace anchorsplat {

inline bool AllFinite(const float* values, int64_t count) {
  return std::all_of(values, values + count, [](float x) { return std::isfinite(x); });
}

inline float FiniteOr(float value, float otherwise) { return std::isfinite(value) ? value : otherwise; }

// Brought into 0–1; `otherwise` for what is not finite.
inline float UnitOr(float value, float otherwise) {
  return std::isfinite(value) ? std::clamp(value, 0.0f, 1.0f) : otherwise;
}

}  // namespace anchorsplat
