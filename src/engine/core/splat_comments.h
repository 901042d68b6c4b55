#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/cloud_view.h"

namespace anchorsplat {

// What a splat says about itself in its comments (GaussianCloud::comments). PLY and compressed PLY keep them all, glTF
// and SOG those below; elsewhere the word is lost (SplatFormat::comments).
//
// Two more are taken out of the comments when a file is read: the render mode (formats/ply/render_mode_tag.h) and the
// origin of the means (core/world_origin.h).

// With what comments begin that say that a splat, or a part of it, has all its width: who gives it more, blurs it.
inline constexpr std::string_view kEnhancedMark = "enhanced by anchorsplat: ";
inline constexpr std::string_view kPartEnhancedMark = "enhanced in part by anchorsplat: ";
inline constexpr std::string_view kPixelAreaMark = "fitted to pixel areas, seen ";
bool IsMark(std::string_view comment);  // any of the three
bool HasMark(std::span<const std::string> comments, std::string_view mark);

// An enhanced splat: enhanced once more, it would be blurred, as the width that its fit lost has been given back
// already. `method` as in EnhanceReport::method. `invented`: EnhanceMethod::invents of one of them.
std::string EnhancedComment(const std::string& method, double upscale, bool invented = false);
bool IsMarkedEnhanced(const CloudView& cloud);

// The same of a splat of which a region has been enhanced: another region may be, but not the whole.
std::string PartEnhancedComment(const std::string& method, double upscale, bool invented = false);
bool IsMarkedPartEnhanced(const CloudView& cloud);

// A splat that was fitted to the areas of pixels (fit/pixel_model.h): it has not lost the width that standard fits
// lose.
std::string PixelAreaComment(double upscale);
bool IsFittedToPixelAreas(const CloudView& cloud);

// Whether there is nothing to give back to the whole of it, as far as the file says: one of the three marks.
bool HasLostNoWidth(const CloudView& cloud);

// Whose a splat is and under which licence: the comments that begin with "credit: ", without it. Licences such as CC BY
// ask for it wherever the splat is shown, so pages and pictures that we make of a splat carry it, and so do the formats
// that have a place for it.
std::vector<std::string> CreditsOf(std::span<const std::string> comments);
// The credits as one text, a line each, for formats that have one member for whose a file is. Empty: there are none.
std::string CopyrightOf(std::span<const std::string> comments);
// The comments that say what such a text says, a credit for each of its lines that is not blank.
std::vector<std::string> CommentsOfCopyright(std::string_view copyright);

// The background that a splat was trained over, rgb 0–1 ("trained over: 1 1 1"): fits write it where it is not black.
// Refinement and cleaning look there when neither the command nor the cameras' file says.
std::string BackgroundComment(const std::array<float, 3>& background);
// Of the first such comment whose three numbers lie in 0–1; nothing where there is none.
std::optional<std::array<float, 3>> BackgroundOf(const std::vector<std::string>& comments);

// Where up is in a splat's world (core/world_up.h).
std::string UpComment(const std::array<double, 3>& up);
// What comments say of it: a unit vector. Ours count before those of other programs, "Vertical axis: z" as nerfstudio
// has it, or three numbers, or an axis with its sign. Nothing where there is none or a broken one, nor for the bare
// "Vertical axis: y": Brush writes that whatever its splat, and the usual up lies along this axis anyway.
std::optional<std::array<double, 3>> UpOf(const std::vector<std::string>& comments);
// Leaves no other word of it in them.
void SetUp(const std::array<double, 3>& up, std::vector<std::string>& comments);
// Rewrites them for a world that is turned or mirrored by the orthogonal `matrix` (row-major), in our words.
void TurnUpComments(const std::array<double, 9>& matrix, std::vector<std::string>& comments);

}  // namespace anchorsplat
