#pragma once

#include <array>
#include <cmath>
#include <optional>

namespace anchorsplat {

// Vectors of three, in their own precision. Sums run from left to right, so results are the same on every machine.

template <typename T>
T Dot(const T* a, const T* b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <typename T>
T Dot(const std::array<T, 3>& a, const std::array<T, 3>& b) {
  return Dot(a.data(), b.data());
}

template <typename T>
std::array<T, 3> Cross(const std::array<T, 3>& a, const std::array<T, 3>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

template <typename T>
std::array<T, 3> Minus(const std::array<T, 3>& a, const std::array<T, 3>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

// `v` with a length of 1; nothing where its length is not finite or `least` at most.
inline std::optional<std::array<double, 3>> UnitVector(const std::array<double, 3>& v, double least) {
  const double length = std::hypot(v[0], v[1], v[2]);
  if (!(length > least) || !std::isfinite(length)) return std::nullopt;
  return std::array{v[0] / length, v[1] / length, v[2] / length};
}

}  // namespace anchorsplat
