#pragma once

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/axes.h"
#include "formats/cloud_io.h"
#include "formats/format_facts.h"
#include "io/input_file.h"

namespace anchorsplat {

// Reads Niantic's SPZ, versions 1–3 (one gzip stream: a header of 16 bytes, then the sections of spz_sections.h) and 4
// (a header of 32 bytes starting with "NGSP", extension records, a table of sizes, one zstd stream per non-empty
// section). Axes are RUB, or those of the record SPZ_ADOBE_coordinate_system (spz_extensions.h), and are converted to
// RDF. A set antialiased flag means kAntialiased; a clear one means nothing, as most programs never set it. Degree 4 is
// read as 3; unknown records give a warning.
//
// Errors (kBadFile): damaged or shorter than the header states, another version, more than 24 fractional bits,
// truncated records or invalid axes, more than `limits.max_gaussians`, a decompression bomb.
Result<GaussianCloud> ReadSpz(const InputFile& file, const ReadLimits& limits = {});

// Count and degree from the header. Errors: those of ReadSpz.
Result<CloudExtent> ExtentOfSpz(const InputFile& file);

// Version, fractional bits, flags, axes. Errors: those of ReadSpz.
Result<FormatFacts> DescribeSpz(const InputFile& file);

// Axes of the file's numbers. Errors: those of ReadSpz.
Result<Axes> DeclaredAxesOfSpz(const InputFile& file);

}  // namespace anchorsplat
