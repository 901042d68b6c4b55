#pragma once

#include <cstdint>
#include <limits>

#include "core/gaussian_cloud.h"
#include "core/render_mode.h"

namespace anchorsplat {

// All constants of the 3DGS rasterizer except those of the render modes (core/render_mode.h).
inline constexpr float kMinAlpha = kMinOpacity;    // smaller contributions are invisible at 8 bits
inline constexpr float kMaxAlpha = 0.999f;         // keeps 1/(1−α) finite in the backward pass (gsplat ≤ 1.5)
inline constexpr float kMinTransmittance = 1e-4f;  // stop *before* the Gaussian that would cross it
// gsplat's near and far planes, world units along z, as used by fits. Displayed splats may have any unit
// (render/shown_range.h): their near plane is at most this fraction of the distance to them, and there is no far plane.
inline constexpr float kNear = 0.01f;
inline constexpr float kFar = 1e10f;
inline constexpr float kNearShare = 1e-3f;
inline constexpr float kNoFar = std::numeric_limits<float>::max();
inline constexpr int kTile = 16;               // px: granularity of gsplat's screen culling, visible in its output
inline constexpr float kFrustumMargin = 0.3f;  // x/z in the Jacobian is clamped to the image plus 30 % of its tangent
inline constexpr double kExtent14 = 3.0;       // σ_max: half side of the square in gsplat 1.0–1.4
inline constexpr double kExtent15 = 3.33;      // maximum σ per axis in gsplat 1.5, where opacity 1 falls to 1/255
inline constexpr double kMinEigenGap = 0.01;  // px⁴: lower bound of b² − det in gsplat 1.0–1.4's largest eigenvalue

// Constants of this implementation, which affect speed and memory but not pixels.
inline constexpr int kBlock = 4;                        // px: a 4×4 block is one 16-lane register
inline constexpr int64_t kProjectChunk = 1024;          // Gaussians per task of the per-Gaussian kernels
inline constexpr int64_t kMaxPairs = int64_t{1} << 26;  // (tile, Gaussian) pairs listed at once: 256 MiB

}  // namespace anchorsplat
