#pragma once

#include <memory>

#include "core/cloud_blocks.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "io/input_file.h"

namespace anchorsplat {

// The splat of ReadGltf, block by block. `file` must outlive it. Errors: those of ReadGltf; read errors come from
// ForEach.
Result<std::unique_ptr<CloudBlocks>> BlocksOfGltf(const InputFile& file, const ReadLimits& limits);

}  // namespace anchorsplat
