#pragma once

#include "core/result.h"
#include "formats/ply/ply_header.h"
#include "io/input_file.h"

namespace anchorsplat {

inline constexpr const char* kColorSpace = "color_space";

// Whether a PLY declares linear colours, as SHARP's do: an element `color_space` of one row and property, 0 for sRGB
// and 1 for linear RGB. False without it. kBadFile: another value, a missing row, an element that can only be reached
// by reading lists.
Result<bool> HasLinearColors(const InputFile& file, const PlyHeader& header);

}  // namespace anchorsplat
