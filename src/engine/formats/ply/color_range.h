#pragma once

#include <span>

#include "core/gaussian_cloud.h"
#include "formats/extra_properties.h"
#include "formats/ply/ply_layout.h"
#include "io/input_file.h"

namespace anchorsplat {

// Full intensity of colours stored as floats: normally 1, but 255 or 65,535 where programs kept 8- or 16-bit values.
// Some values above 1 are no evidence, as bright light and rounding cause them; most values, implausibly bright ones,
// or only whole numbers are.
float FullIntensityOf(std::span<const float> colors);

// Determines layout.full_color from the rows of a PLY, if its types do not tell. A message reports values other than 1;
// `extras`, if not null, receives it.
void FindFullColor(const InputFile& file, const GaussianCloud& rows, PlyLayout& layout, ExtraProperties* extras);

}  // namespace anchorsplat
