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

// Writes PlayCanvas's SOG version 2 (layout: sog_reader.h): a ZIP archive for names that end in .sog, and for a
// meta.json that file with the pictures beside it. By default in Morton order, which the pictures need to shrink.
// The codebooks of scales and colours are optimal (scalar_codebook.h), the SH palette has at most 65,536 entries
// (sh_palette.h), as many as other programs give: 1,024·2^⌊log₂(N/1024)⌋, at least 1,024.
// Lost: means are rounded to 1/65535 of the range of sign(x)·ln(|x| + 1), quaternion components to 1/360, log-scales
// and f_dc to one of 256 values, opacities to 1/255, SH to the palette; scales are clamped to e^±20. Of the render mode
// only whether opacity is compensated is kept ("model": "antialiased"), and of the comments the credits
// ("asset.copyright").
// The files of a folder appear when all of them are complete, meta.json last.
// Errors: kExists (each file of a folder), kIo, kBadArgument (arrays that disagree, no Gaussians, more than fit a
// picture).
Status WriteSog(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options = {});

// The pictures of a splat of that degree by name, in the order in which they are drawn.
std::span<const char* const> SogPictures(int sh_degree);
// Where they are for a meta.json; none for an archive.
std::vector<std::filesystem::path> SogFilesBeside(const std::filesystem::path& path, int sh_degree);

// From what splats of real scenes take per Gaussian, and the palette (docs/formats.md has the deviations).
uint64_t EstimatedSogSize(int64_t count, int sh_degree);

// What would make all others coarser than it is worth.
Strays SogStrays(const CloudView& cloud);

// A sentence when Gaussians far out stretch the range of the means so much that it is coarse for most of them.
std::string SogMeanLoss(const CloudView& cloud);

}  // namespace anchorsplat
