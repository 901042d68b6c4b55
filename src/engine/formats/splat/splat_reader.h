#pragma once

#include <memory>

#include "core/cloud_blocks.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "io/input_file.h"

namespace anchorsplat {

// Reads a .splat file as antimatter15's viewer keeps them: 32 bytes per Gaussian without any header: mean 3 × float,
// scale (a length, not its logarithm) 3 × float, colour and opacity 4 × byte (value·255), quaternion wxyz 4 × byte
// (value·128 + 128). SH degree 0. As the format has no mark, its size and values tell that it is one.
//
// Errors (kBadFile): the size is no multiple of 32 bytes or zero, more than `limits.max_gaussians`, or more than half
// of the rows have a position or scale that is not finite, beyond kSplatExtent or, for scales, negative: that is text
// or another format under this name.
Result<GaussianCloud> ReadSplat(const InputFile& file, const ReadLimits& limits = {});

// The same, to look at block by block. Errors as ReadSplat; what rows tell comes from the first ForEach.
Result<std::unique_ptr<CloudBlocks>> BlocksOfSplat(const InputFile& file, const ReadLimits& limits);

// Whether the size is a whole number of rows, and the first ones have positions and lengths of a scene and quaternions
// of length one: what no file of another kind has by chance.
bool LooksLikeSplat(const InputFile& file);

inline constexpr size_t kSplatRecord = 32;  // bytes

// Nobody measures a scene in units of which it has more, while most of what is no float is beyond.
inline constexpr float kSplatExtent = 1e12f;

// Whether three coordinates and three lengths are those of no scene: more than half of the rows of a .splat file may
// not be, or it is taken for something else.
bool IsNoSplatRow(const float numbers[6]);

}  // namespace anchorsplat
