#include "core/sh_rotation.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "core/spherical_harmonics.h"

namespace anchorsplat {

namespace {

constexpr int kDirections = 32;  // any well-spread number above 7 determines all degrees

std::array<double, 3> Direction(int i) {
  const double z = 1 - (2 * i + 1.0) / kDirections, ring = std::sqrt(1 - z * z);
  const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
  return {ring * std::cos(angle), ring * std::sin(angle), z};
}

// X of A·X = B by Gaussian elimination with pivots; A [n,n] is symmetric and well-conditioned here.
void Solve(int n, std::vector<double>& a, std::vector<double>& b) {
  for (int k = 0; k < n; ++k) {
    int pivot = k;
    for (int i = k + 1; i < n; ++i) {
      if (std::abs(a[static_cast<size_t>(i * n + k)]) > std::abs(a[static_cast<size_t>(pivot * n + k)])) pivot = i;
    }
    for (int j = 0; j < n; ++j) {
      std::swap(a[static_cast<size_t>(k * n + j)], a[static_cast<size_t>(pivot * n + j)]);
      std::swap(b[static_cast<size_t>(k * n + j)], b[static_cast<size_t>(pivot * n + j)]);
    }
    for (int i = 0; i < n; ++i) {
      if (i == k) continue;
      const double factor = a[static_cast<size_t>(i * n + k)] / a[static_cast<size_t>(k * n + k)];
      for (int j = 0; j < n; ++j) {
        a[static_cast<size_t>(i * n + j)] -= factor * a[static_cast<size_t>(k * n + j)];
        b[static_cast<size_t>(i * n + j)] -= factor * b[static_cast<size_t>(k * n + j)];
      }
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) b[static_cast<size_t>(i * n + j)] /= a[static_cast<size_t>(i * n + i)];
  }
}

}  // namespace

// The new coefficients c' satisfy Y(d)·c' = Y(Mᵀd)·c for all d. Within a degree both sides span the same functions, so
// least squares over a few directions has no residual.
ShRotation::ShRotation(const std::array<double, 9>& m) {
  std::array<std::array<double, 16>, kDirections> before{}, after{};
  for (int i = 0; i < kDirections; ++i) {
    const auto [x, y, z] = Direction(i);
    before[static_cast<size_t>(i)] = ShBasis(x, y, z);
    after[static_cast<size_t>(i)] =
        ShBasis(m[0] * x + m[3] * y + m[6] * z, m[1] * x + m[4] * y + m[7] * z, m[2] * x + m[5] * y + m[8] * z);
  }
  for (int degree = 1; degree <= 3; ++degree) {
    const int n = 2 * degree + 1, first = degree * degree;
    std::vector<double> normal(static_cast<size_t>(n * n)), right(normal);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        for (size_t k = 0; k < kDirections; ++k) {
          normal[static_cast<size_t>(i * n + j)] +=
              before[k][static_cast<size_t>(first + i)] * before[k][static_cast<size_t>(first + j)];
          right[static_cast<size_t>(i * n + j)] +=
              before[k][static_cast<size_t>(first + i)] * after[k][static_cast<size_t>(first + j)];
        }
      }
    }
    Solve(n, normal, right);
    std::copy(right.begin(), right.end(), blocks_[static_cast<size_t>(degree - 1)].begin());
  }
}

void ShRotation::Apply(float* coefficients, int degree) const {
  for (int l = 1; l <= degree; ++l) {
    const int n = 2 * l + 1;
    float* values = coefficients + 3 * l * l;
    std::array<double, 21> old{};
    std::copy(values, values + 3 * n, old.begin());
    for (int i = 0; i < n; ++i) {
      for (int c = 0; c < 3; ++c) {
        double sum = 0;
        for (int j = 0; j < n; ++j) {
          sum +=
              blocks_[static_cast<size_t>(l - 1)][static_cast<size_t>(i * n + j)] * old[static_cast<size_t>(3 * j + c)];
        }
        values[3 * i + c] = static_cast<float>(sum);
      }
    }
  }
}

}  // namespace anchorsplat
