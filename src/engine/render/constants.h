#pragma once

#include <cstdint>
#include <limits>

#include "core/gaussian_cloud.h"
#include "core/render_mode.h"

namespace anchorsplat {

// All numbers of the 3DGS rasterizer, in one place; those of the render modes are in core/render_mode.h.
inline constexpr float kMinAlpha = kLeastOpacity;  // smaller contributions are invisible at 8 bits
inline constexpr float kMaxAlpha = 0.999f;         // keeps 1/(1−α) of the backward pass finite (gsplat ≤ 1.5)
inline constexpr float kMinTransmittance = 1e-4f;  // stop *before* the Gaussian that would cross it
// gsplat's near and far plane, world units along z: what a fit draws. A splat that is shown may have any unit
// (render/shown_range.h): there the near plane is at most this part of the distance to it, and nothing is too far.
inline constexpr float kNear = 0.01f;
inline constexpr float kFar = 1e10f;
inline constexpr float kNearShare = 1e-3f;
inline constexpr float kNoFar = std::numeric_limits<float>::max();
inline constexpr int kTile = 16;               // px: the unit of gsplat's screen culling, part of its output
inline constexpr float kFrustumMargin = 0.3f;  // the Jacobian's x/z is clamped to the image plus 30 % of its tangent
inline constexpr double kExtent14 = 3.0;       // σ_max: half side of the square of gsplat 1.0–1.4
inline constexpr double kExtent15 = 3.33;      // σ per axis at most in gsplat 1.5: where opacity 1 falls to 1/255
inline constexpr double kMinEigenGap = 0.01;  // px⁴: floor under b² − det in gsplat 1.0–1.4's largest eigenvalue

// Numbers of this implementation. They change its speed and memory, never its pixels.
inline constexpr int kBlock = 4;                        // px: a 4×4 block is one 16-lane register
inline constexpr int64_t kProjectChunk = 1024;          // Gaussians per task of the per-Gaussian kernels
inline constexpr int64_t kMaxPairs = int64_t{1} << 26;  // (tile, Gaussian) pairs listed at once: 256 MiB

}  // namespace anchorsplat
