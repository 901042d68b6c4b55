#pragma once

#include <array>

namespace anchorsplat {

// Principal axes of a 3-D covariance: the variance along each, unsorted, and the axes as columns of a row-major
// rotation.
struct Ellipsoid {
  std::array<double, 3> variances;
  std::array<double, 9> axes;
};

// Eigendecomposition of a symmetric matrix (xx xy xz yy yz zz) by Jacobi's method. Rounding may leave a variance
// slightly negative.
Ellipsoid EllipsoidOf(const std::array<double, 6>& covariance);

}  // namespace anchorsplat
