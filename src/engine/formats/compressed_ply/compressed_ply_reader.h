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

// Gaussians per row of element "chunk", which share its ranges.
inline constexpr int64_t kCompressedPlyChunk = 256;

// Reads PlayCanvas's compressed PLY. Element "chunk" has the ranges of 256 Gaussians each, as floats: min_/max_ of x y
// z, of log-scales and, in newer files, of r g b. Element "vertex" has four uints per Gaussian, first component in the
// highest bits:
//   packed_position, packed_scale  11-10-11 bits within the chunk's range
//   packed_rotation                2 bits for the index of the largest component (0 = w), 3 × 10 bits q·√½ + ½
//                                  for the others
//   packed_color                   8-8-8-8, opacity (not its logit) last; colour is 0.5 + 0.2820948·f_dc, within the
//                                  chunk's range if given
// Optional element "sh": bytes f_rest_0 … (9, 24 or 45), channel-major, (byte + ½)/256·8 − 4, where 0 and 255 are −4
// and 4.
//
// Errors (kBadFile): missing elements or properties, or of another type; not binary little-endian; inconsistent counts;
// fewer bytes than the header states; more than `limits.max_gaussians`.
Result<GaussianCloud> ReadCompressedPly(const InputFile& file, const ReadLimits& limits = {});

// The same, block by block. Errors: those of ReadCompressedPly.
Result<std::unique_ptr<CloudBlocks>> BlocksOfCompressedPly(const InputFile& file, const ReadLimits& limits);

// Count and degree from the header. Errors: those of ReadCompressedPly.
Result<CloudExtent> ExtentOfCompressedPly(const InputFile& file);

// Chunks, colour ranges and SH element. Errors: those of ReadCompressedPly.
Result<FormatFacts> DescribeCompressedPly(const InputFile& file);

}  // namespace anchorsplat
