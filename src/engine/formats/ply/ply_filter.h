#pragma once

#include <cstdint>
#include <span>

#include "core/gaussian_cloud.h"
#include "core/render_mode.h"
#include "core/result.h"
#include "io/input_file.h"

namespace anchorsplat {

// Makes Mip-Splatting's smoothing filter a part of the Gaussians, as the "fused" file of its program has it: every
// program draws those, none but its own knows the property. `rows` are those of the file from `first` on, `sizes` has
// one for each. Errors (kBadFile): a size that is none, with its row.
Status FuseFilter(const InputFile& file, std::span<const float> sizes, int64_t first, GaussianCloud& rows);

// Says so. What trains so is drawn with compensated opacity: `mode` is what was made of that.
void SayFilterIsFused(const InputFile& file, RenderMode mode);

}  // namespace anchorsplat
