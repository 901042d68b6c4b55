#pragma once

#include <memory>

#include "core/cloud_blocks.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "io/input_file.h"

namespace anchorsplat {

// What ReadSpz would give, to look at block by block: decompressed anew each time, some hundred thousand rows at once.
// The harmonics only the first time, to see that they are not damaged. Of a gzip stream, in which the sections lie one
// behind the other, the state at the begin of each is kept. `file` must outlive it. Errors as ReadSpz; those of the
// sections come from the first ForEach.
Result<std::unique_ptr<CloudBlocks>> BlocksOfSpz(const InputFile& file, const ReadLimits& limits);

}  // namespace anchorsplat
