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
// 16 bytes per Gaussian, 72 per 256, and 9, 24 or 45 for SH. Render mode and comments go to the header.
// Lost: means and log-scales are rounded to 1/2047 (y: 1/1023) of the range of their chunk, log-scales clamped to ±20,
// quaternion components to 1/1447, colours to 1/255 of the chunk's range, opacities to 1/255, SH to 1/32 within ±4.
// Errors: kExists, kIo, kBadArgument (arrays that disagree, no Gaussians).
Status WriteCompressedPly(const std::filesystem::path& path, const CloudView& cloud,
                          const CloudWriteOptions& options = {});

uint64_t PredictedCompressedPlySize(int64_t count, int sh_degree);

// What would make all others coarser than it is worth.
Strays CompressedPlyStrays(const CloudView& cloud);

// A sentence where chunks of this cloud reach so far that their 2047 steps are coarse; else nothing. One Gaussian far
// out does that to those that share its chunk, and farther out still, where the Morton order tells no others apart, to
// all.
std::string CompressedPlyMeanLoss(const CloudView& cloud);

}  // namespace anchorsplat
