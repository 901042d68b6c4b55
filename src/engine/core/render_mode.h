#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace anchorsplat {

// How a splat wants to be rasterized: how much Gaussians are widened in a picture, and whether opacity makes up for it.
//
//   kClassic      0.3 px² and nothing else (Kerbl et al. 2023). Fits absorb it.
//   kAntialiased  0.3 px², and opacity is scaled by sqrt(det Σ₂ / det(Σ₂ + 0.3 I)), which keeps a Gaussian's integral:
//                 "antialiased" of gsplat, nerfstudio and INRIA's own code. Fits have little to absorb.
//   kMip          the same with 0.1 px²: Mip-Splatting (Yu et al. 2024, eq. 10), LichtFeld's mip filter, Brush's mip.
enum class RenderMode { kClassic, kAntialiased, kMip };

inline constexpr float kDilation = 0.3f;     // px²: the low-pass of Kerbl et al. 2023, see docs/method.md
inline constexpr float kMipDilation = 0.1f;  // px²: near the 1/12 px² of a pixel's own box

// What is added to both variances of a 2-D covariance, px².
constexpr float DilationOf(RenderMode mode) { return mode == RenderMode::kMip ? kMipDilation : kDilation; }

inline constexpr std::array kRenderModes = {RenderMode::kClassic, RenderMode::kAntialiased, RenderMode::kMip};

// Whether a Gaussian that is widened gets fainter for it.
constexpr bool IsCompensated(RenderMode mode) { return mode != RenderMode::kClassic; }
// A splat that does not say its mode is a classic one.
constexpr bool IsCompensated(std::optional<RenderMode> mode) { return mode && IsCompensated(*mode); }

// The words of the command line and of `info`.
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

// The mode of that name; none for any other word.
constexpr std::optional<RenderMode> RenderModeNamed(std::string_view name) {
  for (const RenderMode mode : kRenderModes) {
    if (name == NameOf(mode)) return mode;
  }
  return std::nullopt;
}

}  // namespace anchorsplat
