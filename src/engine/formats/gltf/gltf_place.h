#pragma once

#include <array>
#include <optional>

namespace anchorsplat {

// Placement by a node: x' = scale·turn·x + translation. `turn` is orthogonal, row-major, and mirrors if its determinant
// is −1.
struct GltfPlace {
  double scale = 1;
  std::array<double, 9> turn = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  std::array<double, 3> translation = {0, 0, 0};

  bool turns() const { return turn != GltfPlace{}.turn; }
  bool mirrors() const;
};

// Decomposes x' = matrix·x + translation; none if the scale is anisotropic by more than 1e-4, or zero. Removes rounding
// of the file's numbers: columns are orthogonalised, and an almost exact right-angle turn becomes exact.
std::optional<GltfPlace> PlaceOf(const std::array<double, 9>& matrix, const std::array<double, 3>& translation);

}  // namespace anchorsplat
