#pragma once

#include <filesystem>
#include <vector>

#include "core/result.h"
#include "edit/edit_files.h"
#include "formats/opened_splat.h"
#include "formats/ply/ply_input.h"

namespace anchorsplat {

// EditFiles for binary PLYs that become a PLY, block by block. Memory: a byte per Gaussian and some megabytes per
// thread.

// The inputs if the whole job can be streamed, else none.
Result<std::vector<PlyInput>> StreamableInputs(const EditJob& job, const std::filesystem::path& output,
                                               const std::vector<OpenedSplat>& files, bool kept);

Result<EditReport> EditStreams(const EditJob& job, const std::filesystem::path& output,
                               const std::vector<OpenedSplat>& files, const std::vector<PlyInput>& inputs);

}  // namespace anchorsplat
