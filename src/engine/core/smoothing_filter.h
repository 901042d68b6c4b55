#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "core/gaussian_cloud.h"

namespace anchorsplat {

// A Gaussian convolved with an isotropic one of standard deviation f, keeping its integral: the 3-D smoothing filter of
// Mip-Splatting (Yu et al. 2024, eq. 9).
//   s'² = s² + f²,   o' = o·√(Π s²/Π s'²)
// Kept as logarithms: s may be 0, and a flat Gaussian may lose all opacity.
struct Smoothing {
  std::array<double, 3> log_scales{};  // ln s'
  std::array<double, 3> shares{};      // s²/s'²
  double log_opacity_factor = 0;       // ln √(Π s²/Π s'²)

  // 1 − o' for the given opacity, without cancellation if o' is nearly 1.
  double Transmittance(double opacity_logit) const;
};

// `log_scales` [3]; `size`: f > 0, world units.
Smoothing SmoothingOf(const float* log_scales, double size);

// Filters all Gaussians. `sizes` [N]: f of each, world units; 0 leaves a Gaussian unchanged. Outputs `log_scales` [N,3]
// and `opacity_logits` [N] may be the cloud's own arrays.
void Smooth(const GaussianCloud& cloud, std::span<const float> sizes, float* log_scales, float* opacity_logits);

}  // namespace anchorsplat
