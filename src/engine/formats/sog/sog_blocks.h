#pragma once

#include <memory>

#include "core/cloud_blocks.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "io/input_file.h"

namespace anchorsplat {

// What ReadSog would give, to look at block by block. The pictures are decoded once, one at a time, and kept as bytes:
// 17 per Gaussian, beside the archive. Their labels of harmonics are looked at and not kept. Errors as ReadSog.
Result<std::unique_ptr<CloudBlocks>> BlocksOfSog(const InputFile& file, const ReadLimits& limits);

}  // namespace anchorsplat
