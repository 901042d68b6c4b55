#include "enhance/soft_pictures.h"

#include "core/run_context.h"
#include "enhance/pixel_size_estimate.h"
#include "enhance/pixel_size_features.h"

namespace anchorsplat {

namespace {

constexpr double kSoftOutlines = 0.75;
constexpr double kNotWidened = 0.3;  // SizeTails::roundness

}  // namespace

std::optional<TrainedKind> BesideSoftness(std::optional<TrainedKind> kind, std::optional<RenderMode> tag,
                                          const ShowingGaussians& showing) {
  if (tag || !(kind == TrainedKind::kAntialiased || kind == TrainedKind::kUnclear)) return kind;
  LeaveIfAbandoned();
  // Widths that were added soften outlines, too.
  if (kind == TrainedKind::kUnclear && SizeTailsOf(showing.all).roundness > kNotWidened) return kind;
  Result<PixelSizeProbe> probe = PixelSizeProbe::Make(showing.telling);
  if (!probe.ok()) return kind;
  const auto estimate = EstimatePixelSize(*probe, RenderMode::kClassic);
  return estimate.ok() && estimate->softness < kSoftOutlines ? TrainedKind::kClassic : kind;
}

}  // namespace anchorsplat
