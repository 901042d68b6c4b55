#pragma once

#include <memory>

#include "core/cloud_blocks.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "io/input_file.h"

namespace anchorsplat {

// What ReadGltf would give, to look at block by block. `file` must outlive it. Errors as ReadGltf; those of reading
// come from ForEach.
Result<std::unique_ptr<CloudBlocks>> BlocksOfGltf(const InputFile& file, const ReadLimits& limits);

}  // namespace anchorsplat
