#pragma once

#include <array>

namespace anchorsplat {

// Of a Gaussian with a given covariance: variances along its own axes, in no order, and these axes as the columns of a
// row-major rotation.
struct Ellipsoid {
  std::array<double, 3> variances;
  std::array<double, 9> axes;
};

// Eigenvalues and eigenvectors of a symmetric matrix xx xy xz yy yz zz by Jacobi's method. Rounding may leave a
// variance a little below zero.
Ellipsoid EllipsoidOf(const std::array<double, 6>& covariance);

}  // namespace anchorsplat
