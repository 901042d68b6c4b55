#pragma once

#include <array>
#include <cmath>

namespace anchorsplat {

// Row-major rotation matrix of a wxyz quaternion of any non-zero norm. The zero quaternion gives the identity, as
// viewers do.
template <typename T>
std::array<T, 9> RotationFromQuaternion(T w, T x, T y, T z) {
  const T norm = std::sqrt(w * w + x * x + y * y + z * z);
  if (!(norm > 0)) return {1, 0, 0, 0, 1, 0, 0, 0, 1};
  w /= norm;
  x /= norm;
  y /= norm;
  z /= norm;
  return {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
          2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
          2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
}

// The rotation nearest to an almost-rotation, exact to double precision: the eight digits of a file would move a camera
// at 4,500,000 m by centimetres.
std::array<double, 9> NearestRotation(const std::array<double, 9>& matrix);

// wxyz unit quaternion (w ≥ 0) of a row-major rotation matrix.
std::array<double, 4> QuaternionFromRotation(const std::array<double, 9>& rotation);

}  // namespace anchorsplat
