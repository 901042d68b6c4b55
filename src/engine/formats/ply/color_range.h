#pragma once

#include <span>

#include "core/gaussian_cloud.h"
#include "formats/extra_properties.h"
#include "formats/ply/ply_layout.h"
#include "io/input_file.h"

namespace anchorsplat {

// What stands for full intensity in colours stored as floats: 1 as a rule, 255 or 65,535 where programs left the
// numbers of bytes or of 16 bits as they were. Some beyond 1 say nothing, which bright light and rounding have; most of
// them, or many as bright as no light is, or whole numbers only, do.
float IntensityOfOne(std::span<const float> colors);

// Finds layout.full_color, once the rows of a PLY are read, where floats do not say it by themselves, which a message
// says where it is not 1; `extras`, which may be null, get it.
void FindFullColor(const InputFile& file, const GaussianCloud& rows, PlyLayout& layout, ExtraProperties* extras);

}  // namespace anchorsplat
