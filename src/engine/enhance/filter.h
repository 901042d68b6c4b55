#pragma once

#include <optional>
#include <span>

#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// The training-free filter. The standard rasterizer adds 0.3 px² to every projected variance, and fits absorb that:
// each Gaussian is eroded by as much at the pixel size of its training views. The filter restores it,
//     Σ' = Σ + max(0, f·0.3·p_LR² − d·p_HR²)·I,   p_HR = p_LR / upscale,
// in world units, with d the dilation of the splat's render mode (0.3; 0.1 of kMip). Opacity is unchanged: scaling it
// to keep the integral costs 4 dB. Adding a multiple of I only lengthens the three axes; rotations stay. docs/method.md
// derives it and shows the curve over f.
struct FilterOptions {
  double upscale = 4;              // u ≥ 1: how many times closer the splat will be seen
  std::optional<double> strength;  // f, 0 to kMaxFilterStrength; unset: DefaultFilterStrength
};

// f = 1 − (1 − 1/u²)/3.6: replaces the box variance (1/12 px²) of the low-resolution pixel in the 0.3 px² by that of
// the high-resolution pixel. 0.740 at u = 4; 1 at u = 1, where the filter changes nothing. This holds for kClassic.
// Other modes compensate the dilation by opacity, and less width is worth restoring (docs/method.md).
double DefaultFilterStrength(double upscale, std::optional<RenderMode> mode = {});
// Strength that equals the closer view's own dilation, d / 0.3 / u². Up to it the filter changes nothing.
double ShownStrength(double upscale, std::optional<RenderMode> mode);
inline constexpr double kMaxFilterStrength = 100;  // far beyond anything sensible; catches typing errors

// Applies the filter in place and returns how many Gaussians grew. `pixel_sizes`: p_LR in world units, one for all or
// one per Gaussian. Log-scales of −Inf (scale 0) become finite where variance is added; non-finite rows are unchanged.
// Errors (kBadArgument): upscale < 1; a strength out of range; a wrong number of pixel sizes, or one not positive and
// finite.
Result<int64_t> ApplyFilter(GaussianCloud& cloud, std::span<const float> pixel_sizes, const FilterOptions& options);

}  // namespace anchorsplat
