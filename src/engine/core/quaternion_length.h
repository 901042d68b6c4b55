#pragma once

#include <cmath>

namespace anchorsplat {

// Of a quaternion as it is stored; only its direction means something.
inline double QuaternionLength(const float* q) {
  return std::sqrt(double{q[0]} * q[0] + double{q[1]} * q[1] + double{q[2]} * q[2] + double{q[3]} * q[3]);
}

// Whether it is off one by more than 1 %; .splat rounds lengths of one by up to 0.8 %. Not that of NaN.
inline bool IsNotNormalised(double length) { return std::abs(length - 1) > 0.01; }

}  // namespace anchorsplat
