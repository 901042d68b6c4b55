#pragma once

#include <memory>

#include "core/cloud_blocks.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "io/input_file.h"

namespace anchorsplat {

// Reads a .splat file of antimatter15's viewer: 32 bytes per Gaussian without a header: mean 3 × float, scale (a
// length, not its logarithm) 3 × float, colour and opacity 4 × byte (value·255), quaternion wxyz 4 × byte (value·128 +
// 128). SH degree 0. Without a magic number, size and values identify it.
//
// Errors (kBadFile): size zero or not a multiple of 32 bytes; more than `limits.max_gaussians`; more than half of the
// rows have a position or scale that is not finite, beyond kSplatExtent or, for scales, negative: such a file is text
// or another format.
Result<GaussianCloud> ReadSplat(const InputFile& file, const ReadLimits& limits = {});

// The same, block by block. Errors: those of ReadSplat; those about rows come from the first ForEach.
Result<std::unique_ptr<CloudBlocks>> BlocksOfSplat(const InputFile& file, const ReadLimits& limits);

// Whether the size is a multiple of a row, and the first rows have plausible positions and lengths and unit
// quaternions, which other files do not have by chance.
bool LooksLikeSplat(const InputFile& file);

inline constexpr size_t kSplatRecord = 32;  // bytes

// World units; scenes are smaller, while most random bytes are larger as floats.
inline constexpr float kSplatExtent = 1e12f;

// Whether a row's three coordinates and three lengths are implausible. If more than half of the rows are, the file is
// not a .splat.
bool IsImplausibleRow(const float numbers[6]);

}  // namespace anchorsplat
