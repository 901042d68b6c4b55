#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// Splits every Gaussian into `copies` smaller ones, so that optimisation can form detail. Positions are normally
// distributed with `spread` of its standard deviations along its axes; axes are divided by √copies^shrink. Opacity and
// colours are copied. This looks worse than the original until a few steps have been made.
//
// With `each`, Gaussian i is split into each[i] copies by the same rule; 1 leaves it unchanged.
struct SplitOptions {
  int copies = 4;  // K ≥ 1
  double spread = 0.7;
  double shrink = 0.8;
  uint64_t seed = 0;
  std::span<const int> each = {};  // [N], ≥ 1; empty: `copies` for all
};

// Copies of row i follow those of row i − 1. Errors (kBadArgument): copies below 1, or over 2^31 rows; `each` of the
// wrong length; negative spread or shrink.
Result<GaussianCloud> SplitGaussians(const GaussianCloud& cloud, const SplitOptions& options);

// Distributes `all` copies (nearly, if limits interfere) over Gaussians in proportion to the square root of their
// residuals (≥ 0), from 1 to kMostShare · copies each. More copies do not help where the splat is already right.
inline constexpr int kMostShare = 4;
std::vector<int> CopiesByResidual(std::span<const double> residuals, int copies, int64_t all);

}  // namespace anchorsplat
