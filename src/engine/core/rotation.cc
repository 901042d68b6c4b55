#include "core/rotation.h"

#include <algorithm>

namespace anchorsplat {

std::array<double, 9> NearestRotation(const std::array<double, 9>& matrix) {
  // Newton's iteration for the polar decomposition (Higham 1986): halfway to the inverse of the transpose, whose
  // distance from a rotation is squared each time.
  std::array<double, 9> r = matrix;
  for (int i = 0; i < 6; ++i) {
    const std::array<double, 9> cofactors = {
        r[4] * r[8] - r[5] * r[7], r[5] * r[6] - r[3] * r[8], r[3] * r[7] - r[4] * r[6],
        r[2] * r[7] - r[1] * r[8], r[0] * r[8] - r[2] * r[6], r[1] * r[6] - r[0] * r[7],
        r[1] * r[5] - r[2] * r[4], r[2] * r[3] - r[0] * r[5], r[0] * r[4] - r[1] * r[3]};
    const double determinant = r[0] * cofactors[0] + r[1] * cofactors[1] + r[2] * cofactors[2];
    for (size_t k = 0; k < 9; ++k) r[k] = 0.5 * (r[k] + cofactors[k] / determinant);
  }
  return r;
}

std::array<double, 4> QuaternionFromRotation(const std::array<double, 9>& r) {
  // Shepperd's method: divide by the largest component, which never is small.
  const std::array<double, 4> squares = {1 + r[0] + r[4] + r[8], 1 + r[0] - r[4] - r[8], 1 - r[0] + r[4] - r[8],
                                         1 - r[0] - r[4] + r[8]};
  const auto largest = std::max_element(squares.begin(), squares.end()) - squares.begin();
  const double root = std::sqrt(std::max(0.0, squares[static_cast<size_t>(largest)]));
  const double s = root > 0 ? 0.5 / root : 0;
  std::array<double, 4> q{};
  switch (largest) {
    case 0:
      q = {0.5 * root, (r[7] - r[5]) * s, (r[2] - r[6]) * s, (r[3] - r[1]) * s};
      break;
    case 1:
      q = {(r[7] - r[5]) * s, 0.5 * root, (r[1] + r[3]) * s, (r[2] + r[6]) * s};
      break;
    case 2:
      q = {(r[2] - r[6]) * s, (r[1] + r[3]) * s, 0.5 * root, (r[5] + r[7]) * s};
      break;
    default:
      q = {(r[3] - r[1]) * s, (r[2] + r[6]) * s, (r[5] + r[7]) * s, 0.5 * root};
      break;
  }
  if (q[0] < 0) {
    for (double& x : q) x = -x;
  }
  return q;
}

}  // namespace anchorsplat
