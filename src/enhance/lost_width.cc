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
    case LostWidthReason::kTooFew:
      return "too few Gaussians";
    case LostWidthReason::kFittedToAreas:
      return "fitted to pixel areas";
    case LostWidthReason::kMarkedEnhanced:
      return "enhanced before";
    case LostWidthReason::kWidened:
      return "widened";
    case LostWidthReason::kWidenedButTagged:
      return "widened, but tagged antialiased";
  }
  return "";
}

LostWidth FindLostWidth(const CloudView& cloud, std::optional<TrainedKind> looks, double upscale) {
  if (IsFittedToPixelAreas(cloud)) return {0, LostWidthReason::kFittedToAreas};
  if (IsMarkedEnhanced(cloud)) return {0, LostWidthReason::kMarkedEnhanced};
  if (looks == TrainedKind::kWidened) {
    if (!cloud.render_mode) return {0, LostWidthReason::kWidened};
    if (cloud.render_mode == RenderMode::kAntialiased) return {0, LostWidthReason::kWidenedButTagged};
  }
  if (cloud.render_mode) return {DefaultFilterStrength(upscale, cloud.render_mode), LostWidthReason::kTagged};
  if (!looks) return {DefaultFilterStrength(upscale), LostWidthReason::kTooFew};
  if (looks == TrainedKind::kUnclear) {
    return {DefaultFilterStrength(upscale, RenderMode::kAntialiased), LostWidthReason::kUnclear};
  }
  const auto mode = looks == TrainedKind::kAntialiased ? RenderMode::kAntialiased : RenderMode::kClassic;
  return {DefaultFilterStrength(upscale, mode), LostWidthReason::kSizes};
}

}  // namespace anchorsplat
