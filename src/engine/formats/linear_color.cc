#include "formats/linear_color.h"

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/parallel.h"
#include "core/spherical_harmonics.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr int kColorDirections = 64;

double SrgbOf(double light) {
  if (std::isnan(light)) return light;
  if (light <= 0.0031308) return light > 0 ? 12.92 * light : 0.0;
  return 1.055 * std::pow(light, 1 / 2.4) - 0.055;
}

// Inverts a symmetric, well-conditioned matrix [n,n] in place.
void InvertSymmetric(std::vector<double>& a, int n) {
  std::vector<double> inverse(a.size(), 0.0);
  for (int k = 0; k < n; ++k) inverse[static_cast<size_t>(k * n + k)] = 1;
  for (int k = 0; k < n; ++k) {
    const double pivot = a[static_cast<size_t>(k * n + k)];
    for (int j = 0; j < n; ++j) {
      a[static_cast<size_t>(k * n + j)] /= pivot;
      inverse[static_cast<size_t>(k * n + j)] /= pivot;
    }
    for (int i = 0; i < n; ++i) {
      if (i == k) continue;
      const double factor = a[static_cast<size_t>(i * n + k)];
      for (int j = 0; j < n; ++j) {
        a[static_cast<size_t>(i * n + j)] -= factor * a[static_cast<size_t>(k * n + j)];
        inverse[static_cast<size_t>(i * n + j)] -= factor * inverse[static_cast<size_t>(k * n + j)];
      }
    }
  }
  a = std::move(inverse);
}

}  // namespace

LinearColor::LinearColor(int sh_degree) : coefficients_(ShCoefficients(sh_degree)) {
  const int n = coefficients_, directions = sh_degree == 0 ? 1 : kColorDirections;
  for (int i = 0; i < directions; ++i) {
    const double z = 1 - (2 * i + 1.0) / directions, ring = std::sqrt(1 - z * z);
    const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const auto basis = ShBasis(ring * std::cos(angle), ring * std::sin(angle), z);
    basis_.insert(basis_.end(), basis.begin(), basis.begin() + n);
  }
  std::vector<double> normal(static_cast<size_t>(n * n), 0.0);
  for (size_t d = 0; d < basis_.size(); d += static_cast<size_t>(n)) {
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        normal[static_cast<size_t>(i * n + j)] +=
            basis_[d + static_cast<size_t>(i)] * basis_[d + static_cast<size_t>(j)];
      }
    }
  }
  InvertSymmetric(normal, n);
  inverse_.resize(basis_.size());
  for (int i = 0; i < n; ++i) {
    for (int d = 0; d < directions; ++d) {
      double sum = 0;
      for (int j = 0; j < n; ++j)
        sum += normal[static_cast<size_t>(i * n + j)] * basis_[static_cast<size_t>(d * n + j)];
      inverse_[static_cast<size_t>(i * directions + d)] = sum;
    }
  }
}

void LinearColor::ToSrgb(float* sh) const {
  const int n = coefficients_, directions = static_cast<int>(basis_.size()) / n;
  for (int channel = 0; channel < 3; ++channel) {
    std::array<double, kColorDirections> colors;
    for (int d = 0; d < directions; ++d) {
      double color = 0.5;
      for (int k = 0; k < n; ++k) color += basis_[static_cast<size_t>(d * n + k)] * double{sh[3 * k + channel]};
      colors[static_cast<size_t>(d)] = SrgbOf(color) - 0.5;
    }
    for (int k = 0; k < n; ++k) {
      double sum = 0;
      for (int d = 0; d < directions; ++d) {
        sum += inverse_[static_cast<size_t>(k * directions + d)] * colors[static_cast<size_t>(d)];
      }
      sh[3 * k + channel] = static_cast<float>(sum);
    }
  }
}

std::string LinearColorInWords(int sh_degree) {
  return Cat("its colours are linear light; converted to sRGB",
             sh_degree > 0 ? " (spherical harmonics approximately)" : "",
             ", so overlapping Gaussians blend slightly differently");
}

void SrgbFromLinear(GaussianCloud& cloud, int64_t first, int64_t count) {
  const LinearColor color(cloud.sh_degree);
  ParallelFor(first, first + count, 1 << 12, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) color.ToSrgb(cloud.sh.data() + i * cloud.sh_stride());
  });
}

}  // namespace anchorsplat
