#pragma once

#include <memory>

#include "core/cloud_blocks.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/format_facts.h"
#include "io/input_file.h"

namespace anchorsplat {

// Reads mkkellogg's KSPLAT, version 0.1, compression levels 0–2: a header of 4,096 bytes, one of 1,024 per section,
// then per section the sizes of partly filled buckets, all bucket centres, and the Gaussians: mean, scales (lengths),
// quaternion wxyz, colour and opacity as bytes, SH of degree 1 and 2 (or 3), each degree channel by channel. Level 0
// has floats; 1 has 16-bit means relative to bucket centres and half floats; 2 also has SH as bytes in a range from the
// header. Sections of lower degree are padded with zeros.
//
// Errors (kBadFile): another version or level, fewer bytes than the headers state, inconsistent counts, more than
// `limits.max_gaussians`.
Result<GaussianCloud> ReadKsplat(const InputFile& file, const ReadLimits& limits = {});

// The same, block by block. Errors: those of ReadKsplat; a Gaussian outside all buckets is reported by the first
// ForEach.
Result<std::unique_ptr<CloudBlocks>> BlocksOfKsplat(const InputFile& file, const ReadLimits& limits);

// Whether the headers of file and sections are valid for a KSPLAT of this size.
bool LooksLikeKsplat(const InputFile& file);

// Version, compression level, sections. Errors: those of ReadKsplat.
Result<FormatFacts> DescribeKsplat(const InputFile& file);

}  // namespace anchorsplat
