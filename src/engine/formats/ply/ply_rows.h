#pragma once

#include <cstdint>
#include <vector>

#include "core/result.h"
#include "formats/ply/ply_header.h"
#include "formats/ply/ply_layout.h"
#include "io/input_file.h"

namespace anchorsplat {

// The three kinds of PLY body. The rows of element `vertex` go to `to`, one per property (ply_layout.h), which has room
// for all of them.

// Rows [first, last) of binary ones of one size that begin at byte `begin`, to row 0 and on of `to`. In parallel, block
// by block.
Status ReadFixedRows(const InputFile& file, const PlyElement& vertex, PlyEncoding encoding, uint64_t begin,
                     int64_t first, int64_t last, const std::vector<PlyDestination>& to);

// Binary rows with lists, whose places are only known by reading the ones before.
Status ReadRowsWithLists(SequentialReader& reader, const InputFile& file, const PlyElement& vertex,
                         PlyEncoding encoding, const std::vector<PlyDestination>& to);
Status SkipRowsWithLists(SequentialReader& reader, const InputFile& file, const PlyElement& element,
                         PlyEncoding encoding);

// The body of an ASCII file, one row per line; elements before "vertex" are passed over. Warns of what is
// behind the last row where the header has no element there.
Status ReadAsciiBody(const InputFile& file, const PlyHeader& header, const PlyElement& vertex,
                     const std::vector<PlyDestination>& to);

}  // namespace anchorsplat
