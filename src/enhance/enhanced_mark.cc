#include "enhance/enhanced_mark.h"

#include "core/lost_nothing_mark.h"
#include "core/text.h"
#include "fit/pixel_model.h"

namespace anchorsplat {

std::string EnhancedComment(const std::string& method, double upscale) {
  return Cat(kEnhancedMark, method, ", ", upscale, " times closer");
}

bool IsMarkedEnhanced(const CloudView& cloud) { return HasMark(cloud.comments, kEnhancedMark); }

std::string PartEnhancedComment(const std::string& method, double upscale) {
  return Cat(kPartEnhancedMark, method, ", ", upscale, " times closer");
}

bool IsMarkedPartEnhanced(const CloudView& cloud) { return HasMark(cloud.comments, kPartEnhancedMark); }

bool HasLostNoWidth(const CloudView& cloud) {
  return IsFittedToPixelAreas(cloud) || IsMarkedEnhanced(cloud) || IsMarkedPartEnhanced(cloud);
}

}  // namespace anchorsplat
