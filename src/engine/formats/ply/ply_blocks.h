#pragma once

#include <memory>

#include "core/cloud_blocks.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "io/input_file.h"

namespace anchorsplat {

// The splat of ReadPly, block by block, read in every pass with a few megabytes per thread and a byte per Gaussian.
// Null unless the file consists of binary little-endian floats. `file` must outlive it. Errors: those of ReadPly; read
// errors and invalid 3-D filter sizes come from ForEach.
Result<std::unique_ptr<CloudBlocks>> BlocksOfPly(const InputFile& file, const ReadLimits& limits);

}  // namespace anchorsplat
