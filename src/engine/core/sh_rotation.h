#pragma once

#include <array>
#include <cstdint>

namespace anchorsplat {

// Transforms spherical harmonics for a rotated or mirrored world: with the orthogonal matrix M (row-major, determinant
// ±1) the function f(d) becomes f(Mᵀ·d). Each degree has its own matrix; degree 0 is invariant.
class ShRotation {
 public:
  explicit ShRotation(const std::array<double, 9>& matrix);

  // In place: `coefficients` [C,3], coefficient-major, C = (degree + 1)².
  void Apply(float* coefficients, int degree) const;

 private:
  std::array<std::array<double, 49>, 3> blocks_{};  // of degree 1, 2, 3: (2l+1)² values, row-major
};

}  // namespace anchorsplat
