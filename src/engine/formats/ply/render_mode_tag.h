#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/render_mode.h"

namespace anchorsplat {

// What the comments of a PLY header say about the render mode, in any case of letters (docs/formats.md):
//
//   SplatRenderMode: default     classic; Brush's words, taken over by other programs
//   SplatRenderMode: mip         opacity is compensated, and for which dilation is another matter: Brush draws such
//                                files with 0.1 px², others write it for gsplat's "antialiased", 0.3 px². So it is kMip
//                                where the header also has a comment "Exported from Brush", else kAntialiased, unless
//   SplatRenderDilation: 0.1     says so (0.3 for kAntialiased): our own word
//   antialiased 1, antialiased 0 kAntialiased or classic; Postshot's words
//
// The last one of the first, second and fourth kind counts, as in other readers: tools that rewrite a file append their
// own.
class RenderModeTag {
 public:
  // Looks at a comment (without the keyword "comment"). Whether it is one of the above, and thus no other comment.
  bool Take(std::string_view comment);
  std::optional<RenderMode> mode() const;  // of those that were taken; nothing where none said any

 private:
  enum class Word { kNone, kDefault, kMip, kAntialiased };
  Word last_ = Word::kNone;
  bool by_brush_ = false;
  std::optional<double> dilation_;  // px²
};

// Whether a comment that Take() did not take begins as a tag does, so that its writer meant to say something about the
// mode: "SplatRenderMode: 2dgs", "SplatRenderDilation: wide", "antialiased yes".
bool LooksLikeModeTag(std::string_view comment);

// The comments that say a mode, so that programs that know only Brush's or no dilation understand as much as they can.
std::vector<std::string> CommentsOf(RenderMode mode);

}  // namespace anchorsplat
