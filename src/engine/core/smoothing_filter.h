#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "core/gaussian_cloud.h"

namespace anchorsplat {

// A Gaussian convolved with a round one of standard deviation f, which keeps its integral: the 3-D smoothing filter of
// Mip-Splatting (Yu et al. 2024, eq. 9).
//   s'² = s² + f²,   o' = o·√(Π s²/Π s'²)
// Logarithms throughout: s may be 0, and all of a flat Gaussian's opacity may go.
struct Smoothing {
  std::array<double, 3> log_scales{};  // ln s'
  std::array<double, 3> shares{};      // s²/s'²
  double log_kept = 0;                 // ln √(Π s²/Π s'²)

  // 1 − o' of a Gaussian with this opacity, without cancellation where o' is nearly 1.
  double LeftOpen(double opacity_logit) const;
};

// `log_scales` [3], `size` f > 0 in world units.
Smoothing SmoothingOf(const float* log_scales, double size);

// Of all Gaussians, each with its own f: `sizes` [N] world units; 0 leaves a Gaussian as it is. The results,
// `log_scales` [N,3] and `opacity_logits` [N], may be the cloud's own arrays.
void Smooth(const GaussianCloud& cloud, std::span<const float> sizes, float* log_scales, float* opacity_logits);

}  // namespace anchorsplat
