#pragma once

#include <algorithm>
#include <span>
#include <string>
#include <string_view>

namespace anchorsplat {

// With what comments begin (GaussianCloud::comments) that say that a splat, or a part of it, has all its width: who
// gives it more, blurs it. PLY and compressed PLY keep comments, glTF and SOG those that begin so; elsewhere the word
// is lost.
inline constexpr std::string_view kEnhancedMark = "enhanced by anchorsplat: ";  // enhance/enhanced_mark.h
inline constexpr std::string_view kPartEnhancedMark = "enhanced in part by anchorsplat: ";
inline constexpr std::string_view kPixelAreaMark = "fitted to pixel areas, seen ";  // fit/pixel_model.h

inline bool IsMark(std::string_view comment) {
  return comment.starts_with(kEnhancedMark) || comment.starts_with(kPartEnhancedMark) ||
         comment.starts_with(kPixelAreaMark);
}

inline bool HasMark(std::span<const std::string> comments, std::string_view mark) {
  return std::ranges::any_of(comments, [&](const std::string& comment) { return comment.starts_with(mark); });
}

}  // namespace anchorsplat
