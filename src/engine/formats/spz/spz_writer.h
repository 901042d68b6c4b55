#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/strays.h"

namespace anchorsplat {

// Writes Niantic's SPZ (layout: spz_reader.h, spz_sections.h) of `options.spz_version`, 3 or 4, with axes RUB as the
// specification says, so y and z change sign. The antialiased flag is set for modes that compensate
// opacity.
// Fractional bits of the means: 12 as everywhere, more where a scene is so small that 1/4096 would be more than 1/65536
// of it, fewer where a mean would not fit into 24 bits.
// Lost: means are rounded to 2^−bits, log-scales to 1/16 within −10 … 5.9, quaternion components to 1/723 (the largest,
// which follows from the others, is off by 1/482 at most), opacities to 1/255, f_dc to 1/38 within ±3.33, SH to 1/16
// (degree 1) and 1/8 within ±1. Which of those modes it is, and comments have no place.
// Errors: kExists, kIo, kBadArgument (arrays that disagree, no Gaussians, another version).
Status WriteSpz(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options = {});

// From what splats of real scenes take per Gaussian (docs/formats.md has the deviations).
uint64_t EstimatedSpzSize(int64_t count, int sh_degree);

// What would make all others coarser than it is worth.
Strays SpzStrays(const CloudView& cloud);

// A sentence when this cloud has fewer than 12 fractional bits because of coordinates far from zero, and that is coarse
// for most of it; or when a coordinate does not fit at all. Nothing otherwise.
std::string SpzMeanLoss(const CloudView& cloud);

}  // namespace anchorsplat
