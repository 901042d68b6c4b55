#include "enhance/enhanced_mark.h"

#include <algorithm>
#include <string_view>

#include "core/text.h"
#include "fit/pixel_model.h"

namespace anchorsplat {

namespace {

constexpr std::string_view kEnhanced = "enhanced by anchorsplat: ";

}  // namespace

std::string EnhancedComment(const std::string& method, double upscale) {
  return Cat(kEnhanced, method, ", ", upscale, " times closer");
}

bool IsMarkedEnhanced(const CloudView& cloud) {
  return std::any_of(cloud.comments.begin(), cloud.comments.end(),
                     [](const std::string& comment) { return comment.starts_with(kEnhanced); });
}

bool HasLostNoWidth(const CloudView& cloud) { return IsFittedToPixelAreas(cloud) || IsMarkedEnhanced(cloud); }

}  // namespace anchorsplat
