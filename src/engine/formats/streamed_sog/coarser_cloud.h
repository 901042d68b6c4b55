#pragma once

#include <cstdint>

#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Simplifies a splat to `target` Gaussians (1 to N) that look the same from farther away: merges pairs of neighbours,
// those that change the splat least first. Unmerged Gaussians stay bit-exact, and the order is kept. For one block of a
// splat: memory is about 300 bytes per Gaussian.
//
// A Gaussian's weight is w = o·S, opacity times surface of its ellipsoid (Kerbl et al. 2024, "A Hierarchical 3D
// Gaussian Representation"), so that the most visible count most. Merging preserves moments:
//
//   w = w₁ + w₂,  p = w₁/w,  μ = p μ₁ + (1−p) μ₂,  Σ = p Σ₁ + (1−p) Σ₂ + p (1−p) (μ₁−μ₂)(μ₁−μ₂)ᵀ
//
// SH are averaged with the same shares; opacity is w/S of the new ellipsoid. Above 1 it becomes 1, and scales grow by
// √(w/S), at most by a fifth. The cost of a merge is Runnalls's bound on the Kullback-Leibler divergence (2007,
// "Kullback-Leibler Approach to Gaussian Mixture Reduction", eq. 21), ½ (w ln|Σ| − w₁ ln|Σ₁| − w₂ ln|Σ₂|), with colour
// as additional dimensions.
//
// All Gaussians must be usable (IsUsable). The result is bit-identical on any number of threads.
GaussianCloud CoarsenCloud(const CloudView& cloud, int64_t target);

}  // namespace anchorsplat
