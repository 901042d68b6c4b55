#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/cloud_view.h"

namespace anchorsplat {

// Statements about a splat in its comments (GaussianCloud::comments). PLY and compressed PLY keep all comments, glTF
// and SOG those below; other formats lose them (SplatFormat::comments).
//
// Two more are removed from the comments on reading: the render mode (formats/ply/render_mode_tag.h) and the origin of
// the means (core/world_origin.h).

// Prefixes of comments that mark a splat, or part of it, as having its full width: widening it again would blur it.
inline constexpr std::string_view kEnhancedMark = "enhanced by anchorsplat: ";
inline constexpr std::string_view kPartEnhancedMark = "enhanced in part by anchorsplat: ";
inline constexpr std::string_view kPixelAreaMark = "fitted to pixel areas, seen ";
bool IsMark(std::string_view comment);  // any of the three
bool HasMark(std::span<const std::string> comments, std::string_view mark);

// Marks an enhanced splat: enhanced again it would be blurred, as it has regained the width that its fit lost.
// `method`: see EnhanceReport::method. `invented`: EnhanceMethod::invents of one of them.
std::string EnhancedComment(const std::string& method, double upscale, bool invented = false);
bool IsMarkedEnhanced(const CloudView& cloud);

// Marks a splat with an enhanced region: another region can still be enhanced, but not the whole.
std::string PartEnhancedComment(const std::string& method, double upscale, bool invented = false);
bool IsMarkedPartEnhanced(const CloudView& cloud);

// Marks a splat fitted to the areas of pixels (fit/pixel_model.h), which has not lost the width that standard fits
// lose.
std::string PixelAreaComment(double upscale);
bool IsFittedToPixelAreas(const CloudView& cloud);

// Whether the splat has any of the three marks, so that it cannot be enhanced as a whole.
bool IsMarkedFullWidth(const CloudView& cloud);

// Attributions of a splat (author, licence): comments that begin with "credit: ", without that prefix. Licences such as
// CC BY require them wherever the splat is shown, so pages, pictures and formats with a place for them carry them.
std::vector<std::string> CreditsOf(std::span<const std::string> comments);
// All credits as one text, a line each, for formats with a single copyright field. Empty if there are none.
std::string CopyrightOf(std::span<const std::string> comments);
// Inverse of CopyrightOf: a credit comment for each non-blank line.
std::vector<std::string> CommentsOfCopyright(std::string_view copyright);

// Records the background a splat was trained over, rgb 0–1 ("trained over: 1 1 1"). Fits write it unless it is black.
// Refinement and cleaning use it if neither the command nor the camera file gives one.
std::string BackgroundComment(const std::array<float, 3>& background);
// Background in the first such comment with three numbers in 0–1; none if there is none.
std::optional<std::array<float, 3>> BackgroundOf(const std::vector<std::string>& comments);

// Records the up direction of a splat's world (core/world_up.h).
std::string UpComment(const std::array<double, 3>& up);
// Up direction in `comments`, as a unit vector. Our comment takes precedence over "Vertical axis: …" of other programs:
// an axis as nerfstudio writes it, a signed axis, or three numbers. None without a well-formed one, and for a bare
// "Vertical axis: y": Brush writes that for every splat, and the usual up is along this axis anyway.
std::optional<std::array<double, 3>> UpOf(const std::vector<std::string>& comments);
// Replaces all up directions in `comments` by `up`.
void SetUp(const std::array<double, 3>& up, std::vector<std::string>& comments);
// Transforms the up direction in `comments` by the orthogonal `matrix` (row-major) and rewrites it as our comment.
void TurnUpComments(const std::array<double, 9>& matrix, std::vector<std::string>& comments);

}  // namespace anchorsplat
