#include "formats/gltf/gltf_place.h"

#include <algorithm>
#include <cmath>

namespace anchorsplat {

namespace {

using Matrix = std::array<double, 9>;

double DeterminantOf(const Matrix& m) {
  return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) + m[2] * (m[3] * m[7] - m[4] * m[6]);
}

// Transposed inverse: cofactors divided by the determinant.
Matrix InverseTransposed(const Matrix& m) {
  const double d = DeterminantOf(m);
  return {(m[4] * m[8] - m[5] * m[7]) / d, (m[5] * m[6] - m[3] * m[8]) / d, (m[3] * m[7] - m[4] * m[6]) / d,
          (m[2] * m[7] - m[1] * m[8]) / d, (m[0] * m[8] - m[2] * m[6]) / d, (m[1] * m[6] - m[0] * m[7]) / d,
          (m[1] * m[5] - m[2] * m[4]) / d, (m[2] * m[3] - m[0] * m[5]) / d, (m[0] * m[4] - m[1] * m[3]) / d};
}

// Deviation of the columns from orthonormal.
double FarFromOrthogonal(const Matrix& m) {
  double far = 0;
  for (size_t a = 0; a < 3; ++a) {
    for (size_t b = 0; b < 3; ++b) {
      const double product = m[a] * m[b] + m[3 + a] * m[3 + b] + m[6 + a] * m[6 + b];
      far = std::max(far, std::abs(product - (a == b ? 1 : 0)));
    }
  }
  return far;
}

}  // namespace

bool GltfPlace::mirrors() const { return DeterminantOf(turn) < 0; }

std::optional<GltfPlace> PlaceOf(const std::array<double, 9>& matrix, const std::array<double, 3>& translation) {
  constexpr double kTolerance = 1e-4, kRounding = 1e-6;
  const double determinant = DeterminantOf(matrix);
  if (!std::isfinite(determinant) || determinant == 0) return std::nullopt;
  GltfPlace place{std::cbrt(std::abs(determinant)), matrix, translation};
  for (double& x : place.turn) x /= place.scale;
  if (!(FarFromOrthogonal(place.turn) <= kTolerance)) return std::nullopt;
  // The nearest orthogonal matrix (Higham 1986); each step squares the error.
  for (int step = 0; step < 4; ++step) {
    const Matrix other = InverseTransposed(place.turn);
    for (size_t k = 0; k < 9; ++k) place.turn[k] = 0.5 * (place.turn[k] + other[k]);
  }
  Matrix whole{};
  std::ranges::transform(place.turn, whole.begin(), [](double x) { return std::round(x) + 0.0; });
  double far = 0;
  for (size_t k = 0; k < 9; ++k) far = std::max(far, std::abs(whole[k] - place.turn[k]));
  if (far < kRounding) place.turn = whole;
  if (std::abs(place.scale - 1) < kRounding) place.scale = 1;
  return place;
}

}  // namespace anchorsplat
