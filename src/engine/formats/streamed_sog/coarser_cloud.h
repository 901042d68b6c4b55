#pragma once

#include <cstdint>

#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat {

// A splat of `target` Gaussians (1 to N) that looks the same from farther away: pairs of neighbours are merged, the
// ones first whose merging changes the splat least, until so many are left. Those that were not merged keep their bits,
// and all keep their order. For a block of a splat: memory is some 300 bytes a Gaussian.
//
// A Gaussian weighs w = o·S, its opacity times the surface of its ellipsoid (Kerbl et al. 2024, "A Hierarchical 3D
// Gaussian Representation"), so that what is seen most counts most. A pair keeps its moments:
//
//   w = w₁ + w₂,  p = w₁/w,  μ = p μ₁ + (1−p) μ₂,  Σ = p Σ₁ + (1−p) Σ₂ + p (1−p) (μ₁−μ₂)(μ₁−μ₂)ᵀ
//
// SH are averaged with the same shares, and its opacity is w/S of the new ellipsoid. Where that is more than 1, it is
// 1, and the lengths grow by √(w/S), by a fifth at most. What merging costs is Runnalls's bound on the Kullback-Leibler
// divergence (2007, "Kullback-Leibler Approach to Gaussian Mixture Reduction", eq. 21), ½ (w ln|Σ| − w₁ ln|Σ₁| − w₂
// ln|Σ₂|), with colour as further dimensions.
//
// All Gaussians must be usable (IsUsable). The bits depend on nothing but the cloud.
GaussianCloud Coarser(const CloudView& cloud, int64_t target);

}  // namespace anchorsplat
