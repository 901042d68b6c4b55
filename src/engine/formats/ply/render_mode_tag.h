#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/render_mode.h"

namespace anchorsplat {

// Render mode in the comments of a PLY header, case-insensitive (docs/formats.md):
//
//   SplatRenderMode: default     classic; defined by Brush, adopted by other programs
//   SplatRenderMode: mip         compensated opacity, of unspecified dilation: Brush draws such files with 0.1 px²,
//                                others for gsplat's "antialiased", 0.3 px². So it means kMip if the header also
//                                has a comment "Exported from Brush", else kAntialiased, unless
//   SplatRenderDilation: 0.1     gives it (0.3 for kAntialiased): our own
//   antialiased 1, antialiased 0 kAntialiased or classic; Postshot's
//
// The last of the first, second and fourth kind counts, as in other readers: tools that rewrite files append their own.
class RenderModeTag {
 public:
  // Parses a comment (without the keyword "comment"); returns whether it is one of the above.
  bool Take(std::string_view comment);
  std::optional<RenderMode> mode() const;  // mode of the parsed comments, if any

 private:
  enum class Word { kNone, kDefault, kMip, kAntialiased };
  Word last_ = Word::kNone;
  bool by_brush_ = false;
  std::optional<double> dilation_;  // px²
};

// Whether a comment that Take() rejected starts like a tag, so that it was meant as one: "SplatRenderMode: 2dgs",
// "SplatRenderDilation: wide", "antialiased yes".
bool LooksLikeModeTag(std::string_view comment);

// Comments that record a mode, so that programs which know only Brush's tag, or no dilation, understand as much as
// possible.
std::vector<std::string> CommentsOf(RenderMode mode);

}  // namespace anchorsplat
