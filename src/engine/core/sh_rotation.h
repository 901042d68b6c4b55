#pragma once

#include <array>
#include <cstdint>

namespace anchorsplat {

// How spherical harmonics change when what they describe is rotated or mirrored: for the orthogonal matrix M
// (row-major, determinant ±1) the function f(d) becomes f(Mᵀ·d). Degrees do not mix, so each has a matrix of its own;
// degree 0 does not change at all.
class ShRotation {
 public:
  explicit ShRotation(const std::array<double, 9>& matrix);

  // In place: `coefficients` [C,3], coefficient-major, C = 1, 4, 9 or 16 of the given degree.
  void Apply(float* coefficients, int degree) const;

 private:
  std::array<std::array<double, 49>, 3> blocks_{};  // of degree 1, 2, 3: (2l+1)² values, row-major
};

}  // namespace anchorsplat
