#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace anchorsplat {

// How a splat is meant to be rasterized: the low-pass (dilation) added to 2-D covariances, and whether opacity
// compensates for it.
//
//   kClassic      0.3 px², no compensation (Kerbl et al. 2023). Fits absorb it.
//   kAntialiased  0.3 px², and opacity is scaled by sqrt(det Σ₂ / det(Σ₂ + 0.3 I)), which keeps a Gaussian's integral:
//                 "antialiased" in gsplat, nerfstudio and INRIA's own code. Fits have little to absorb.
//   kMip          the same with 0.1 px²: Mip-Splatting (Yu et al. 2024, eq. 10), LichtFeld's mip filter, Brush's mip.
enum class RenderMode { kClassic, kAntialiased, kMip };

inline constexpr float kDilation = 0.3f;     // px²: the low-pass of Kerbl et al. 2023, see docs/method.md
inline constexpr float kMipDilation = 0.1f;  // px²: near the 1/12 px² of a pixel's own box

// Dilation: added to both variances of a 2-D covariance, px².
constexpr float DilationOf(RenderMode mode) { return mode == RenderMode::kMip ? kMipDilation : kDilation; }

inline constexpr std::array kRenderModes = {RenderMode::kClassic, RenderMode::kAntialiased, RenderMode::kMip};

// Whether a dilated Gaussian gets fainter in exchange.
constexpr bool IsCompensated(RenderMode mode) { return mode != RenderMode::kClassic; }
// A splat without a stated mode is classic.
constexpr bool IsCompensated(std::optional<RenderMode> mode) { return mode && IsCompensated(*mode); }

// Name on the command line and in `info`.
constexpr std::string_view NameOf(RenderMode mode) {
  switch (mode) {
    case RenderMode::kAntialiased:
      return "antialiased";
    case RenderMode::kMip:
      return "mip";
    default:
      return "classic";
  }
}

// Inverse of NameOf; none for any other word.
constexpr std::optional<RenderMode> RenderModeNamed(std::string_view name) {
  for (const RenderMode mode : kRenderModes) {
    if (name == NameOf(mode)) return mode;
  }
  return std::nullopt;
}

}  // namespace anchorsplat
