#include "core/spherical_harmonics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <numbers>

#include "core/random.h"

namespace anchorsplat {
namespace {

double Factorial(int n) { return n < 2 ? 1 : n * Factorial(n - 1); }

// Without the Condon–Shortley phase, as std::assoc_legendre, which not every standard library has.
double AssociatedLegendre(int l, int m, double x) {
  if (l < m) return 0;
  if (l == m) return l == 0 ? 1 : (2 * l - 1) * std::sqrt(1 - x * x) * AssociatedLegendre(l - 1, l - 1, x);
  return ((2 * l - 1) * x * AssociatedLegendre(l - 1, m, x) - (l + m - 1) * AssociatedLegendre(l - 2, m, x)) / (l - m);
}

// From the definition: real spherical harmonics with the Condon–Shortley phase, by associated Legendre polynomials.
double Reference(int l, int m, double x, double y, double z) {
  const int k = std::abs(m);
  const double norm =
      std::sqrt((2 * l + 1) / (4 * std::numbers::pi) * Factorial(l - k) / Factorial(l + k)) * (k % 2 == 0 ? 1 : -1);
  const double legendre = AssociatedLegendre(l, k, z);
  const double phi = std::atan2(y, x);
  if (m == 0) return norm * legendre;
  return std::numbers::sqrt2 * norm * legendre * (m > 0 ? std::cos(k * phi) : std::sin(k * phi));
}

TEST(SphericalHarmonics, MatchTheDefinition) {
  Random random(1);
  for (int n = 0; n < 100; ++n) {
    double x = random.Normal(), y = random.Normal(), z = random.Normal();
    const double norm = std::hypot(x, y, z);
    x /= norm, y /= norm, z /= norm;
    const auto basis = ShBasis(x, y, z);
    for (int l = 0; l <= 3; ++l) {
      for (int m = -l; m <= l; ++m) {
        EXPECT_NEAR(basis[static_cast<size_t>(l * l + l + m)], Reference(l, m, x, y, z), 1e-6) << l << " " << m;
      }
    }
  }
}

TEST(SphericalHarmonics, ColoursGoThereAndBack) {
  EXPECT_EQ(DcFromColor(0.5f), 0.0f);
  for (const float color : {0.0f, 0.25f, 1.0f}) EXPECT_NEAR(ColorFromDc(DcFromColor(color)), color, 1e-6f);
  // The constant function: a plain colour looks the same from everywhere.
  EXPECT_NEAR(kSh0, 0.5 / std::sqrt(std::numbers::pi), 1e-7);
}

}  // namespace
}  // namespace anchorsplat
