#include "enhance/enhanced_mark.h"

#include "core/lost_nothing_mark.h"
#include "core/text.h"
#include "fit/pixel_model.h"

namespace anchorsplat {

namespace {

std::string Words(const std::string& method, double upscale, bool invented) {
  return Cat(method, ", ", upscale, " times closer", invented ? ", detail invented" : "");
}

}  // namespace

std::string EnhancedComment(const std::string& method, double upscale, bool invented) {
  return Cat(kEnhancedMark, Words(method, upscale, invented));
}

bool IsMarkedEnhanced(const CloudView& cloud) { return HasMark(cloud.comments, kEnhancedMark); }

std::string PartEnhancedComment(const std::string& method, double upscale, bool invented) {
  return Cat(kPartEnhancedMark, Words(method, upscale, invented));
}

bool IsMarkedPartEnhanced(const CloudView& cloud) { return HasMark(cloud.comments, kPartEnhancedMark); }

bool HasLostNoWidth(const CloudView& cloud) {
  return IsFittedToPixelAreas(cloud) || IsMarkedEnhanced(cloud) || IsMarkedPartEnhanced(cloud);
}

}  // namespace anchorsplat
