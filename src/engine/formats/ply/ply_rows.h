#pragma once

#include <cstdint>
#include <vector>

#include "core/result.h"
#include "formats/ply/ply_header.h"
#include "formats/ply/ply_layout.h"
#include "io/input_file.h"

namespace anchorsplat {

// Readers of the three kinds of PLY body. Rows of `vertex` go to `to`, one destination per property (ply_layout.h),
// with room for all.

// Reads binary rows [first, last) of fixed size, which start at byte `begin`, into `to` from row 0 on. In parallel,
// block by block.
Status ReadFixedRows(const InputFile& file, const PlyElement& vertex, PlyEncoding encoding, uint64_t begin,
                     int64_t first, int64_t last, const std::vector<PlyDestination>& to);

// Reads binary rows with lists, whose offsets depend on all previous rows.
Status ReadRowsWithLists(SequentialReader& reader, const InputFile& file, const PlyElement& vertex,
                         PlyEncoding encoding, const std::vector<PlyDestination>& to);
Status SkipRowsWithLists(SequentialReader& reader, const InputFile& file, const PlyElement& element,
                         PlyEncoding encoding);

// Reads the body of an ASCII file, one row per line; skips elements before "vertex". Warns of text after the last row
// if the header has no element there.
Status ReadAsciiBody(const InputFile& file, const PlyHeader& header, const PlyElement& vertex,
                     const std::vector<PlyDestination>& to);

}  // namespace anchorsplat
