#pragma once

namespace anchorsplat {

// All numbers of the classic 3DGS rasterizer, in one place.
inline constexpr float kDilation = 0.3f;  // px²: the low-pass of Kerbl et al. 2023; fits absorb it, see docs/method.md
inline constexpr float kMinAlpha = 1.0f / 255;     // smaller contributions are invisible at 8 bits
inline constexpr float kMaxAlpha = 0.999f;         // keeps 1/(1−α) of the backward pass finite (gsplat ≤ 1.5)
inline constexpr float kMinTransmittance = 1e-4f;  // stop *before* the Gaussian that would cross it
inline constexpr float kNear = 0.01f;              // world units along z
inline constexpr float kFar = 1e10f;
inline constexpr int kTile = 16;               // px: the unit of gsplat's screen culling, part of its output
inline constexpr float kFrustumMargin = 0.3f;  // the Jacobian's x/z is clamped to the image plus 30 % of its tangent

}  // namespace anchorsplat
