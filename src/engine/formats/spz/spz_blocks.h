#pragma once

#include <memory>

#include "core/cloud_blocks.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "io/input_file.h"

namespace anchorsplat {

// The splat of ReadSpz, block by block, decompressed in every pass, some hundred thousand rows at a time. Harmonics are
// decompressed only in the first pass, to verify them. For gzip, whose sections are consecutive in one stream, the
// decompressor state at the start of each is kept. `file` must outlive it. Errors: those of ReadSpz; section errors
// come from the first ForEach.
Result<std::unique_ptr<CloudBlocks>> BlocksOfSpz(const InputFile& file, const ReadLimits& limits);

}  // namespace anchorsplat
