#pragma once

#include <array>
#include <optional>

namespace anchorsplat {

// Where nodes put what they show: x' = scale·turn·x + translation. `turn` is orthogonal, row-major, and mirrors where
// its determinant is −1.
struct GltfPlace {
  double scale = 1;
  std::array<double, 9> turn = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  std::array<double, 3> translation = {0, 0, 0};

  bool turns() const { return turn != GltfPlace{}.turn; }
  bool mirrors() const;
};

// Of x' = matrix·x + translation; nothing where the matrix stretches more one way than another, by more than a
// ten-thousandth, or makes all flat. Rounding of the numbers in a file is undone: columns become orthogonal, and a turn
// that is almost one by right angles is one.
std::optional<GltfPlace> PlaceOf(const std::array<double, 9>& matrix, const std::array<double, 3>& translation);

}  // namespace anchorsplat
