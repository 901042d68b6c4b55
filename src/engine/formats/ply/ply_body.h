#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/ply/ply_header.h"
#include "formats/ply/ply_layout.h"
#include "io/input_file.h"

namespace anchorsplat {

// The rows of `vertex`, an element of `header`, in whatever encoding. `make_room` is called once the file is known to
// have the bytes for them, and gives one destination per property. Errors (kBadFile): the file is shorter than its
// header promises, rows that are no numbers.
Status ReadPlyBody(const InputFile& file, const PlyHeader& header, const PlyElement& vertex,
                   const std::function<std::vector<PlyDestination>()>& make_room);

// The byte where the rows of `vertex` begin in a binary file. Errors: as above.
Result<uint64_t> BeginOfPlyRows(const InputFile& file, const PlyHeader& header, const PlyElement& vertex);

// Warns of bytes behind the last row of a binary file that has been read, whose last element is `vertex` and none of
// whose elements has lists: of a second file, or of rows that the header knows nothing of. A line end is none.
void WarnOfSurplus(const InputFile& file, const PlyHeader& header, const PlyElement& vertex);

// kBadFile where the header promises more Gaussians than are wanted.
Status CheckGaussianLimit(const InputFile& file, const PlyElement& vertex, const ReadLimits& limits);

}  // namespace anchorsplat
