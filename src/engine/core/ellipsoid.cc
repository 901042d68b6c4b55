#include "core/ellipsoid.h"

#include <cmath>
#include <cstddef>

namespace anchorsplat {

Ellipsoid EllipsoidOf(const std::array<double, 6>& s) {
  double a[3][3] = {{s[0], s[1], s[2]}, {s[1], s[3], s[4]}, {s[2], s[4], s[5]}};
  Ellipsoid out{{}, {1, 0, 0, 0, 1, 0, 0, 0, 1}};
  for (int sweep = 0; sweep < 12; ++sweep) {
    const double off = std::abs(a[0][1]) + std::abs(a[0][2]) + std::abs(a[1][2]);
    if (!(off > 1e-15 * (std::abs(a[0][0]) + std::abs(a[1][1]) + std::abs(a[2][2])))) break;
    for (const auto [p, q] : {std::array<size_t, 2>{0, 1}, {0, 2}, {1, 2}}) {
      if (a[p][q] == 0) continue;
      const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
      const double t = (theta < 0 ? -1 : 1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
      const double c = 1 / std::sqrt(t * t + 1), sine = t * c;
      for (size_t k = 0; k < 3; ++k) {
        const double kp = a[k][p], kq = a[k][q];
        a[k][p] = c * kp - sine * kq;
        a[k][q] = sine * kp + c * kq;
      }
      for (size_t k = 0; k < 3; ++k) {
        const double pk = a[p][k], qk = a[q][k];
        a[p][k] = c * pk - sine * qk;
        a[q][k] = sine * pk + c * qk;
      }
      for (size_t k = 0; k < 3; ++k) {
        const double vp = out.axes[3 * k + p], vq = out.axes[3 * k + q];
        out.axes[3 * k + p] = c * vp - sine * vq;
        out.axes[3 * k + q] = sine * vp + c * vq;
      }
    }
  }
  for (size_t k = 0; k < 3; ++k) out.variances[k] = a[k][k];
  return out;
}

}  // namespace anchorsplat
