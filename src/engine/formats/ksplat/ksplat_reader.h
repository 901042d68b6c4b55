#pragma once

#include <memory>

#include "core/cloud_blocks.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/format_facts.h"
#include "io/input_file.h"

namespace anchorsplat {

// Reads mkkellogg's KSPLAT, version 0.1, compression levels 0–2: a header of 4,096 bytes, one of 1,024 for each
// section, then per section the sizes of its partly filled buckets, the centres of all buckets, and its Gaussians:
// mean, scales (lengths), quaternion wxyz, colour and opacity as bytes, SH of degree 1 and 2 (or 3), each degree
// channel by channel. Level 0 has floats; 1 has means of 16 bits around their bucket's centre and half floats; 2 has in
// addition SH bytes in the range that the header gives. Sections of lower degree get zeros.
//
// Errors (kBadFile): another version or level, fewer bytes than the headers promise, counts that do not belong
// together, more than `limits.max_gaussians`.
Result<GaussianCloud> ReadKsplat(const InputFile& file, const ReadLimits& limits = {});

// The same, to look at block by block. Errors as ReadKsplat; a Gaussian in no bucket comes from the first ForEach.
Result<std::unique_ptr<CloudBlocks>> BlocksOfKsplat(const InputFile& file, const ReadLimits& limits);

// Whether the headers of the file and its sections are those of a KSPLAT of this size.
bool LooksLikeKsplat(const InputFile& file);

// Version, compression level, sections. Errors as ReadKsplat.
Result<FormatFacts> DescribeKsplat(const InputFile& file);

}  // namespace anchorsplat
