#pragma once

#include <cstdint>
#include <span>

#include "core/gaussian_cloud.h"
#include "core/render_mode.h"
#include "core/result.h"
#include "io/input_file.h"

namespace anchorsplat {

// Applies Mip-Splatting's smoothing filter to the Gaussians, as its program does for "fused" files: all programs draw
// those, but only its own knows the property. `rows`: rows of the file from `first` on; `sizes`: one per row. Errors
// (kBadFile): an invalid size, with its row.
Status FuseFilter(const InputFile& file, std::span<const float> sizes, int64_t first, GaussianCloud& rows);

// Reports it. Such splats are drawn with compensated opacity; `mode` is the resulting render mode.
void ReportFusedFilter(const InputFile& file, RenderMode mode);

}  // namespace anchorsplat
