#pragma once

#include <cstdint>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/input_file.h"
#include "formats/ply_header.h"
#include "formats/ply_layout.h"

namespace anchorsplat {

// The three kinds of PLY body. `cloud` has room for all rows of `layout.vertex`.

// Binary rows of one size that begin at byte `begin`. In parallel, block by block.
Status ReadFixedRows(const InputFile& file, const PlyLayout& layout, PlyEncoding encoding, uint64_t begin,
                     GaussianCloud& cloud);

// Binary rows with lists, whose places are only known by reading the ones before.
Status ReadRowsWithLists(SequentialReader& reader, const InputFile& file, const PlyLayout& layout, PlyEncoding encoding,
                         GaussianCloud& cloud);
Status SkipRowsWithLists(SequentialReader& reader, const InputFile& file, const PlyElement& element,
                         PlyEncoding encoding);

// The body of an ASCII file, one row per line; elements before "vertex" are passed over.
Status ReadAsciiBody(const InputFile& file, const PlyHeader& header, const PlyLayout& layout, GaussianCloud& cloud);

}  // namespace anchorsplat
