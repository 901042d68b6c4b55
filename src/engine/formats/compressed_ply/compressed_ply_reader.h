#pragma once

#include <cstdint>
#include <memory>

#include "core/cloud_blocks.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/format_facts.h"
#include "io/input_file.h"

namespace anchorsplat {

// Gaussians that share the ranges of one row of element "chunk".
inline constexpr int64_t kCompressedPlyChunk = 256;

// Reads PlayCanvas's compressed PLY: element "chunk" holds ranges of 256 Gaussians each (min_/max_ of x y z, of the
// log-scales and, in newer files, of r g b, as floats), element "vertex" four uints per Gaussian, first component
// highest: packed_position and packed_scale 11-10-11 bits within the chunk's range, packed_rotation 2 bits for the
// index of the largest component (0 = w) and 3 × 10 bits of q·√½ + ½ for the others, packed_color 8-8-8-8 with opacity
// (not its logit) last; colour is 0.5 + 0.2820948·f_dc, within the chunk's range where there is one. Optional element
// "sh": bytes f_rest_0 … (9, 24 or 45), channel-major, (byte + ½)/256·8 − 4 (the ends 0 and 255 are −4 and 4).
//
// Errors (kBadFile): elements or properties missing or of another type, not binary little-endian, counts that do not
// belong together, fewer bytes than the header promises, more than `limits.max_gaussians`.
Result<GaussianCloud> ReadCompressedPly(const InputFile& file, const ReadLimits& limits = {});

// The same, to look at block by block. Errors as ReadCompressedPly.
Result<std::unique_ptr<CloudBlocks>> BlocksOfCompressedPly(const InputFile& file, const ReadLimits& limits);

// What the header says. Errors as ReadCompressedPly.
Result<CloudExtent> ExtentOfCompressedPly(const InputFile& file);

// Chunks, their colour ranges and the element for SH. Errors as ReadCompressedPly.
Result<FormatFacts> DescribeCompressedPly(const InputFile& file);

}  // namespace anchorsplat
