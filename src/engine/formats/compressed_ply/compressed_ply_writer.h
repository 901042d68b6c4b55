#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/strays.h"

namespace anchorsplat {

// Writes PlayCanvas's compressed PLY (layout: compressed_ply_reader.h), by default in Morton order, with colour ranges:
// 16 bytes per Gaussian, 72 per 256, and 9, 24 or 45 for SH. The header has render mode and comments. Rounding: means
// and log-scales to 1/2047 (y: 1/1023) of their chunk's range, log-scales clamped to ±20, quaternion components to
// 1/1447, colours to 1/255 of the chunk's range, opacities to 1/255, SH to 1/32 within ±4. Errors: kExists, kIo,
// kBadArgument (inconsistent arrays, no Gaussians).
Status WriteCompressedPly(const std::filesystem::path& path, const CloudView& cloud,
                          const CloudWriteOptions& options = {});

uint64_t PredictedCompressedPlySize(int64_t count, int sh_degree);

// Gaussians to hide because they would coarsen all others (strays.h).
Strays CompressedPlyStrays(const CloudView& cloud);

// A message if chunks extend so far that their 2047 steps are coarse, else empty. One distant Gaussian coarsens those
// in its chunk; so distant that the Morton order cannot separate the others, it coarsens all.
std::string CompressedPlyMeanLoss(const CloudView& cloud);

}  // namespace anchorsplat
