#pragma once

#include <memory>

#include "core/cloud_blocks.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "io/input_file.h"

namespace anchorsplat {

// What ReadPly would give, to look at block by block, read from the file each time: a few megabytes per thread and a
// byte per Gaussian. Nothing for files that are not binary little-endian floats throughout. `file` must outlive it.
// Errors: as of ReadPly; those of reading, and of sizes of a 3-D filter, come from ForEach.
Result<std::unique_ptr<CloudBlocks>> BlocksOfPly(const InputFile& file, const ReadLimits& limits);

}  // namespace anchorsplat
