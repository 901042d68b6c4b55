#pragma once

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/axes.h"
#include "formats/cloud_io.h"
#include "formats/format_facts.h"
#include "io/input_file.h"

namespace anchorsplat {

// Reads Niantic's SPZ, versions 1–3 (one gzip stream: a header of 16 bytes, then the sections of spz_sections.h) and 4
// (a header of 32 bytes that begins "NGSP", records of extensions, a table of sizes, one zstd stream per section that
// is not empty). Axes are RUB by the specification or what the record SPZ_ADOBE_coordinate_system says
// (spz_extensions.h), and become RDF. A set antialiased flag becomes kAntialiased; a clear one says nothing, as most
// programs never set it. Degree 4 is read as 3; records that are not known are named in a warning.
//
// Errors (kBadFile): damaged or shorter than the header promises, another version, a fractional part of more than 24
// bits, records that are cut or say axes that do not exist, more than `limits.max_gaussians`, sizes that only a
// decompression bomb has.
Result<GaussianCloud> ReadSpz(const InputFile& file, const ReadLimits& limits = {});

// What the header says of its Gaussians. Errors as ReadSpz.
Result<CloudExtent> ExtentOfSpz(const InputFile& file);

// What the header and the records say: version, fractional bits, flags, axes. Errors as ReadSpz.
Result<FormatFacts> DescribeSpz(const InputFile& file);

// The axes that its numbers are in. Errors as ReadSpz.
Result<Axes> DeclaredAxesOfSpz(const InputFile& file);

}  // namespace anchorsplat
