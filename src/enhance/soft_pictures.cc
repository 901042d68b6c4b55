#include "enhance/soft_pictures.h"

#include "core/run_context.h"
#include "enhance/pixel_size_estimate.h"
#include "enhance/pixel_size_features.h"

namespace anchorsplat {

namespace {

constexpr double kSoftOutlines = 0.75;
// Antialiased fits make their thinnest Gaussians opaque, those to soft pictures at most 7 %; tails of middle axes of
// these are at 0.13 and more. A hedge and a hamburger, antialiased, whose outlines are soft, are at 0.55 and 0.12.
constexpr double kFewOpaque = 0.2, kLeastOfSoft = 0.126;

}  // namespace

std::optional<TrainedKind> BesideSoftness(std::optional<TrainedKind> kind, std::optional<RenderMode> tag,
                                          const ShowingGaussians& showing) {
  if (tag || !(kind == TrainedKind::kAntialiased || kind == TrainedKind::kUnclear)) return kind;
  LeaveIfAbandoned();
  const SizeTails tails = SizeTailsOf(showing.all);
  // Widths that were added soften outlines, too, and so do leaves.
  const bool widened = kind == TrainedKind::kUnclear && tails.rather_round();
  const bool antialiased =
      kind == TrainedKind::kAntialiased && (tails.opaque > kFewOpaque || tails.middle < kLeastOfSoft);
  if (widened || antialiased) return kind;
  Result<PixelSizeProbe> probe = PixelSizeProbe::Make(showing.telling);
  if (!probe.ok()) return kind;
  const auto estimate = EstimatePixelSize(*probe, RenderMode::kClassic);
  return estimate.ok() && estimate->softness < kSoftOutlines ? TrainedKind::kClassic : kind;
}

}  // namespace anchorsplat
