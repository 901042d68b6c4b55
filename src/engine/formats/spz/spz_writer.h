#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/strays.h"

namespace anchorsplat {

// Writes Niantic's SPZ (layout: spz_reader.h, spz_sections.h), version `options.spz_version`, 3 or 4, in its axes RUB,
// so y and z change sign. The antialiased flag is set for modes with compensated opacity. Means have 12 fractional
// bits, as everywhere; more if 1/4096 would exceed 1/65536 of a small scene, fewer if a mean would not fit into 24
// bits. Rounding: means to 2^−bits, log-scales to 1/16 within −10 … 5.9, quaternion components to 1/723 (the largest,
// which is implied, is off by at most 1/482), opacities to 1/255, f_dc to 1/38 within ±3.33, SH to 1/16 (degree 1) and
// 1/8 within ±1. Lost: which compensated mode it is, comments. Errors: kExists, kIo, kBadArgument (inconsistent arrays,
// no Gaussians, another version).
Status WriteSpz(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options = {});

// Estimated from real splats (docs/formats.md has the deviations).
uint64_t EstimatedSpzSize(int64_t count, int sh_degree);

// Gaussians to hide because they would coarsen all others (strays.h).
Strays SpzStrays(const CloudView& cloud);

// A message if distant coordinates leave fewer than 12 fractional bits and that is coarse for most Gaussians, or if a
// coordinate does not fit at all; else empty.
std::string SpzMeanLoss(const CloudView& cloud);

}  // namespace anchorsplat
