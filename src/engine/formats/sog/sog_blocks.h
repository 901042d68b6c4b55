#pragma once

#include <memory>

#include "core/cloud_blocks.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "io/input_file.h"

namespace anchorsplat {

// The splat of ReadSog, block by block. Images are decoded once, one at a time, and kept as bytes: 17 per Gaussian
// besides the archive. SH labels are checked and discarded. Errors: those of ReadSog.
Result<std::unique_ptr<CloudBlocks>> BlocksOfSog(const InputFile& file, const ReadLimits& limits);

}  // namespace anchorsplat
