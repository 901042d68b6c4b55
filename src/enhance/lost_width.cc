#include "enhance/lost_width.h"

#include "enhance/enhanced_mark.h"
#include "enhance/filter.h"
#include "fit/pixel_model.h"

namespace anchorsplat {

std::string_view NameOf(LostWidthReason reason) {
  switch (reason) {
    case LostWidthReason::kTagged:
      return "tagged";
    case LostWidthReason::kSizes:
      return "looks";
    case LostWidthReason::kUnclear:
      return "unclear";
    case LostWidthReason::kRaised:
      return "opacities raised";
    case LostWidthReason::kTooFew:
      return "too few Gaussians";
    case LostWidthReason::kFittedToAreas:
      return "fitted to pixel areas";
    case LostWidthReason::kMarkedEnhanced:
      return "enhanced before";
    case LostWidthReason::kPartMarked:
      return "enhanced in part before";
    case LostWidthReason::kWidened:
      return "widened";
    case LostWidthReason::kWidenedButTagged:
      return "widened, but tagged otherwise";
    case LostWidthReason::kLooksEnhanced:
      return "looks enhanced";
    case LostWidthReason::kEnhancedButTagged:
      return "looks enhanced, but tagged otherwise";
  }
  return "";
}

LostWidth FindLostWidth(const CloudView& cloud, std::optional<TrainedKind> looks, double upscale,
                        std::optional<int64_t> gaussians) {
  if (IsFittedToPixelAreas(cloud)) return {0, LostWidthReason::kFittedToAreas};
  if (IsMarkedEnhanced(cloud)) return {0, LostWidthReason::kMarkedEnhanced};
  if (IsMarkedPartEnhanced(cloud)) return {0, LostWidthReason::kPartMarked};
  if (IsWide(looks) && cloud.render_mode != RenderMode::kMip) {
    const bool enhanced = looks == TrainedKind::kEnhanced;
    if (!cloud.render_mode) return {0, enhanced ? LostWidthReason::kLooksEnhanced : LostWidthReason::kWidened};
    return {0, enhanced ? LostWidthReason::kEnhancedButTagged : LostWidthReason::kWidenedButTagged};
  }
  const double little = DefaultFilterStrength(upscale, RenderMode::kAntialiased);
  if (looks == TrainedKind::kRaised && cloud.render_mode != RenderMode::kMip) return {little, LostWidthReason::kRaised};
  if (cloud.render_mode) return {DefaultFilterStrength(upscale, cloud.render_mode), LostWidthReason::kTagged};
  if (!looks) {
    // Of many Gaussians of which few show, as MCMC leaves them, nearly all are of classic fits.
    const bool many = gaussians.value_or(cloud.size()) >= kFewGaussians;
    return {many ? DefaultFilterStrength(upscale) : little, LostWidthReason::kTooFew};
  }
  if (looks == TrainedKind::kUnclear) return {little, LostWidthReason::kUnclear};
  const auto mode = looks == TrainedKind::kAntialiased ? RenderMode::kAntialiased : RenderMode::kClassic;
  return {DefaultFilterStrength(upscale, mode), LostWidthReason::kSizes};
}

}  // namespace anchorsplat
