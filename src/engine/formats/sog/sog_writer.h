#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/strays.h"

namespace anchorsplat {

// Writes PlayCanvas's SOG version 2 (layout: sog_reader.h): a ZIP archive for *.sog, or a meta.json with its images
// beside it. By default in Morton order, which the images need to compress. The codebooks of scales and colours are
// optimal (scalar_codebook.h); the SH palette has at most 65,536 entries (sh_palette.h), the usual
// 1,024·2^⌊log₂(N/1024)⌋, at least 1,024. Rounding: means to 1/65535 of the range of sign(x)·ln(|x| + 1), quaternion
// components to 1/360, log-scales and f_dc to one of 256 values, opacities to 1/255, SH to the palette; scales are
// clamped to e^±20. Of the render mode only compensation is kept ("model": "antialiased"), of the comments the credits
// ("asset.copyright"). Files of a folder appear when all are complete, meta.json last. Errors: kExists (for each file
// of a folder), kIo, kBadArgument (inconsistent arrays, no Gaussians, more than fit an image).
Status WriteSog(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options = {});

// Image names for a splat of that degree, in encoding order.
std::span<const char* const> SogPictures(int sh_degree);
// Their paths for a meta.json; none for an archive.
std::vector<std::filesystem::path> SogFilesBeside(const std::filesystem::path& path, int sh_degree);

// Estimated from real splats (docs/formats.md has the deviations), including the palette.
uint64_t EstimatedSogSize(int64_t count, int sh_degree);

// Gaussians to hide because they would coarsen all others (strays.h).
Strays SogStrays(const CloudView& cloud);

// A message if distant Gaussians stretch the range of means so much that it is coarse for most, else empty.
std::string SogMeanLoss(const CloudView& cloud);

}  // namespace anchorsplat
