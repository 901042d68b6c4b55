#pragma once

#include <cstdint>
#include <filesystem>

#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/cloud_io.h"

namespace anchorsplat {

// Writes a .splat file (layout: splat_reader.h), by default largest size × opacity first, as viewers show such files
// while loading. Lost: SH beyond degree 0, render mode, comments. Colours, opacities and quaternions are rounded to 8
// bits, colours clamped to 0–1. Errors: kExists, kIo, kBadArgument (inconsistent arrays, no Gaussians).
Status WriteSplat(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options = {});

uint64_t PredictedSplatSize(int64_t count, int sh_degree);

}  // namespace anchorsplat
