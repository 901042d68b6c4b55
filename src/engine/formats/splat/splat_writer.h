#pragma once

#include <cstdint>
#include <filesystem>

#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/cloud_io.h"

namespace anchorsplat {

// Writes a .splat file (layout: splat_reader.h), by default largest size × opacity first, as viewers show such files
// while they load. Lost: SH beyond degree 0; colours, opacities and quaternions are rounded to 8 bits, colours beyond
// 0–1 clamped. Render mode and comments have no place. Errors: kExists, kIo, kBadArgument (arrays that disagree, no
// Gaussians).
Status WriteSplat(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options = {});

uint64_t PredictedSplatSize(int64_t count, int sh_degree);

}  // namespace anchorsplat
