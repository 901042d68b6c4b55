#pragma once

#include <cmath>

namespace anchorsplat {

// Norm of a stored quaternion; only its direction has meaning.
inline double QuaternionLength(const float* q) {
  return std::sqrt(double{q[0]} * q[0] + double{q[1]} * q[1] + double{q[2]} * q[2] + double{q[3]} * q[3]);
}

// Whether a norm is off 1 by more than 1 % (.splat rounds unit quaternions by up to 0.8 %). False for NaN.
inline bool IsNotNormalised(double length) { return std::abs(length - 1) > 0.01; }

}  // namespace anchorsplat
