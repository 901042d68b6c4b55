#pragma once

#include <optional>
#include <span>

#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// The training-free filter. The standard rasterizer adds 0.3 px² to every projected variance and fits absorb it, so
// each Gaussian comes out eroded by that much at the pixel size of its training views. The filter gives it back,
//     Σ' = Σ + max(0, f·0.3·p_LR² − d·p_HR²)·I,   p_HR = p_LR / upscale,
// in world units, d the dilation of the splat's render mode (0.3; 0.1 of kMip), opacity unchanged (scaling it down to
// keep the integral costs 4 dB). Adding a multiple of I only lengthens the three axes; the rotation stays.
// docs/method.md derives it and shows the curve over f.
struct FilterOptions {
  double upscale = 4;              // u ≥ 1: how many times closer the splat will be seen
  std::optional<double> strength;  // f, 0 to kMaxFilterStrength; DefaultFilterStrength unless given
};

// f = 1 − (1 − 1/u²)/3.6: the box variance (1/12 px²) of the low-resolution pixel is taken out of the 0.3 px² and that
// of the high-resolution pixel put back. 0.740 at u = 4, 1 at u = 1, where the filter changes nothing.
// That is for splats of kClassic. Of fits with another mode, which makes up for the widening by opacity, the share of
// the width that is worth giving back is smaller (docs/method.md).
double DefaultFilterStrength(double upscale, std::optional<RenderMode> mode = {});
// The strength that the closer view's own pixels amount to, d / 0.3 / u²: no more than that changes nothing.
double ShownStrength(double upscale, std::optional<RenderMode> mode);
inline constexpr double kMaxFilterStrength = 100;  // far beyond anything sensible; keeps typing errors out

// Applies the filter in place. `pixel_sizes` is p_LR in world units, one value for all Gaussians or one per Gaussian.
// Log-scales of −Inf (scale 0) become finite wherever variance is added; rows that are not finite stay as they are.
// Returns how many Gaussians grew. kBadArgument: upscale < 1, a strength out of range, a pixel size that is not
// positive and finite, or the wrong number of them.
Result<int64_t> ApplyFilter(GaussianCloud& cloud, std::span<const float> pixel_sizes, const FilterOptions& options);

}  // namespace anchorsplat
