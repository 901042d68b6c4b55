#include "enhance/filter.h"

#include <atomic>
#include <cmath>

#include "core/parallel.h"
#include "core/text.h"
#include "core/widened.h"
#include "render/constants.h"

namespace anchorsplat {

namespace {
constexpr int64_t kRowsPerTask = 16384;
// Limit of f for large upscale. Antialiased fits get 0.12 at u = 4 (docs/benchmarks.md#antialiased). Mip-Splatting fits
// keep the width of their 3-D filter; they get almost nothing, just enough for networks to build on.
constexpr double kClassicShare = 1 - 1 / 3.6, kAntialiasedShare = 0.06, kMipShare = 0.01;

}  // namespace

double ShownStrength(double upscale, std::optional<RenderMode> mode) {
  return double{DilationOf(mode.value_or(RenderMode::kClassic))} / double{kDilation} / (upscale * upscale);
}

double DefaultFilterStrength(double upscale, std::optional<RenderMode> mode) {
  const double share = !IsCompensated(mode) ? kClassicShare : mode == RenderMode::kMip ? kMipShare : kAntialiasedShare;
  return ShownStrength(upscale, mode) + share * (1 - 1 / (upscale * upscale));
}

Result<int64_t> ApplyFilter(GaussianCloud& cloud, std::span<const float> pixel_sizes, const FilterOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(cloud));
  if (!(options.upscale >= 1) || !std::isfinite(options.upscale)) {
    return Error{ErrorCode::kBadArgument,
                 Cat("upscale ", options.upscale, " is below 1; the filter is for closer views")};
  }
  const double strength = options.strength.value_or(DefaultFilterStrength(options.upscale, cloud.render_mode));
  if (!(strength >= 0) || strength > kMaxFilterStrength) {
    return Error{ErrorCode::kBadArgument,
                 Cat("filter strength ", strength, " is not between 0 and ", kMaxFilterStrength)};
  }
  if (pixel_sizes.size() != 1 && pixel_sizes.size() != static_cast<size_t>(cloud.size())) {
    return Error{ErrorCode::kBadArgument,
                 Cat(pixel_sizes.size(), " pixel sizes for ", cloud.size(), " Gaussians: expected one, or one each")};
  }
  for (const float p : pixel_sizes) {
    if (!(p > 0) || !std::isfinite(p)) {
      return Error{ErrorCode::kBadArgument, Cat("pixel size ", p, " is not a positive length")};
    }
  }

  // In units of p_LR²: equal for all Gaussians.
  const double gain = kDilation * (strength - ShownStrength(options.upscale, cloud.render_mode));
  if (!(gain > 0)) return int64_t{0};
  std::atomic<int64_t> grown = 0;
  ParallelFor(0, cloud.size(), kRowsPerTask, [&](int64_t first, int64_t last) {
    int64_t count = 0;
    for (int64_t i = first; i < last; ++i) {
      float* scales = cloud.log_scales.data() + 3 * i;
      if (!IsUsable(cloud, i)) continue;
      const double p = pixel_sizes[pixel_sizes.size() == 1 ? 0 : static_cast<size_t>(i)];
      const double log_variance = std::log(gain * p * p);
      for (int axis = 0; axis < 3; ++axis) {
        scales[axis] = static_cast<float>(WidenedLogScale(scales[axis], log_variance));
      }
      ++count;
    }
    grown += count;
  });
  return grown.load();
}

}  // namespace anchorsplat
