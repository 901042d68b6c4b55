#include "core/rotation.h"

#include <algorithm>

namespace anchorsplat {

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
