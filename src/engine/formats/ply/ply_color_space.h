#pragma once

#include "core/result.h"
#include "formats/ply/ply_header.h"
#include "io/input_file.h"

namespace anchorsplat {

inline constexpr const char* kColorSpace = "color_space";

// Whether a PLY declares that its colours are linear light, as SHARP's do: an element `color_space` of one row with one
// property, 0 for sRGB and 1 for linear RGB. False where there is none.
// kBadFile: another number, a row that is not there, an element that cannot be found without reading lists.
Result<bool> HasLinearColors(const InputFile& file, const PlyHeader& header);

}  // namespace anchorsplat
