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

// Reads the rows of `vertex`, an element of `header`, in any encoding. `make_room` is called once the file is known to
// be long enough, and returns a destination per property. Errors (kBadFile): the file is shorter than its header
// states, rows that are not numbers.
Status ReadPlyBody(const InputFile& file, const PlyHeader& header, const PlyElement& vertex,
                   const std::function<std::vector<PlyDestination>()>& make_room);

// Offset of the first row of `vertex` in a binary file. Errors as above.
Result<uint64_t> BeginOfPlyRows(const InputFile& file, const PlyHeader& header, const PlyElement& vertex);

// Warns of bytes after the last row of a binary file that was read, if `vertex` is its last element and no element has
// lists: another file, or rows unknown to the header. A line end is ignored.
void WarnOfSurplus(const InputFile& file, const PlyHeader& header, const PlyElement& vertex);

// kBadFile: more Gaussians than `limits` allow.
Status CheckGaussianLimit(const InputFile& file, const PlyElement& vertex, const ReadLimits& limits);

}  // namespace anchorsplat
