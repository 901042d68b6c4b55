#include "metrics/color_correction.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/parallel.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr int64_t kPixelsPerTask = int64_t{1} << 15;
// In variance of a channel; 8-bit rounding has 1/255²/12 = 1.3e-6.
constexpr double kRidge = 1e-7;

// Moments of the colours x and t of the two images, relative to mid-grey to reduce cancellation.
struct Moments {
  std::array<double, 3> x{}, t{};    // sums
  std::array<double, 9> xx{}, tx{};  // sums of x·xᵀ and t·xᵀ
};
constexpr double kMiddle = 0.5;

void Add(const Moments& part, Moments& sum) {
  const auto add = [](const auto& from, auto& to) {
    for (size_t k = 0; k < from.size(); ++k) to[k] += from[k];
  };
  add(part.x, sum.x), add(part.t, sum.t), add(part.xx, sum.xx), add(part.tx, sum.tx);
}

Moments MomentsOf(const Image& image, const Image& truth) {
  const int64_t pixels = image.plane();
  std::vector<Moments> parts(static_cast<size_t>((pixels + kPixelsPerTask - 1) / kPixelsPerTask));
  ParallelFor(0, pixels, kPixelsPerTask, [&](int64_t first, int64_t last) {
    Moments part;
    for (int64_t i = first; i < last; ++i) {
      double x[3], t[3];
      for (int c = 0; c < 3; ++c) {
        x[c] = image.channel(c)[i] - kMiddle;
        t[c] = truth.channel(c)[i] - kMiddle;
      }
      for (size_t r = 0; r < 3; ++r) {
        part.x[r] += x[r];
        part.t[r] += t[r];
        for (size_t c = 0; c < 3; ++c) {
          part.xx[3 * r + c] += x[r] * x[c];
          part.tx[3 * r + c] += t[r] * x[c];
        }
      }
    }
    parts[static_cast<size_t>(first / kPixelsPerTask)] = part;
  });
  Moments sum;
  for (const Moments& part : parts) Add(part, sum);
  return sum;
}

// X·A⁻¹ for a symmetric, positive definite A, by Cholesky; row by row of X.
std::array<double, 9> DividedBy(const std::array<double, 9>& x, const std::array<double, 9>& a) {
  double l[3][3] = {};
  for (size_t r = 0; r < 3; ++r) {
    for (size_t c = 0; c <= r; ++c) {
      double rest = a[3 * r + c];
      for (size_t k = 0; k < c; ++k) rest -= l[r][k] * l[c][k];
      l[r][c] = r == c ? std::sqrt(std::max(rest, kRidge * 1e-3)) : rest / l[c][c];
    }
  }
  std::array<double, 9> out{};
  for (size_t row = 0; row < 3; ++row) {
    double y[3];
    for (size_t r = 0; r < 3; ++r) {
      y[r] = x[3 * row + r];
      for (size_t k = 0; k < r; ++k) y[r] -= l[r][k] * y[k];
      y[r] /= l[r][r];
    }
    for (size_t r = 3; r-- > 0;) {
      double rest = y[r];
      for (size_t k = r + 1; k < 3; ++k) rest -= l[k][r] * out[3 * row + k];
      out[3 * row + r] = rest / l[r][r];
    }
  }
  return out;
}

}  // namespace

// With means x̄ and t̄, covariances C of x and D of t with x, the minimum of Σ|t − M·x − b|²/N + λ|M − I|² is at
// M = I + (D − C)·(C + λI)⁻¹, b = t̄ − M·x̄.
Result<ColorMap> FitColors(const Image& image, const Image& truth) {
  if (image.width != truth.width || image.height != truth.height || image.channels != truth.channels) {
    return Error{ErrorCode::kBadArgument,
                 Cat("colours of ", image.width, " x ", image.height, " x ", image.channels, " cannot be fitted to ",
                     truth.width, " x ", truth.height, " x ", truth.channels)};
  }
  if (image.channels < 3 || image.plane() < 1) {
    return Error{ErrorCode::kBadArgument, "colour correction needs pictures with pixels and three channels"};
  }
  const Moments sum = MomentsOf(image, truth);
  const auto n = static_cast<double>(image.plane());
  std::array<double, 9> covariance{}, difference{};
  for (size_t r = 0; r < 3; ++r) {
    for (size_t c = 0; c < 3; ++c) {
      const size_t k = 3 * r + c;
      const double xx = sum.xx[k] / n - sum.x[r] * sum.x[c] / (n * n);
      const double tx = sum.tx[k] / n - sum.t[r] * sum.x[c] / (n * n);
      covariance[k] = xx + (r == c ? kRidge : 0);
      difference[k] = tx - xx;
    }
  }
  const std::array<double, 9> change = DividedBy(difference, covariance);
  ColorMap map;
  for (size_t r = 0; r < 3; ++r) {
    double mapped = 0;
    for (size_t c = 0; c < 3; ++c) {
      map.matrix[3 * r + c] += change[3 * r + c];
      mapped += map.matrix[3 * r + c] * (sum.x[c] / n + kMiddle);
    }
    map.offset[r] = sum.t[r] / n + kMiddle - mapped;
  }
  const auto finite = [](double v) { return std::isfinite(v); };
  const bool usable = std::all_of(map.matrix.begin(), map.matrix.end(), finite) &&
                      std::all_of(map.offset.begin(), map.offset.end(), finite);
  return usable ? map : ColorMap{};
}

void ApplyColors(const ColorMap& map, Image& image) {
  float* const channels[3] = {image.channel(0), image.channel(1), image.channel(2)};
  ParallelFor(0, image.plane(), kPixelsPerTask, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) {
      const double rgb[3] = {channels[0][i], channels[1][i], channels[2][i]};
      for (size_t c = 0; c < 3; ++c) {
        const double* row = map.matrix.data() + 3 * c;
        const double mapped = row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2] + map.offset[c];
        channels[c][i] = static_cast<float>(std::clamp(mapped, 0.0, 1.0));
      }
    }
  });
}

}  // namespace anchorsplat
