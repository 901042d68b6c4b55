#pragma once

#include <cstdint>
#include <string>

#include "core/result.h"

namespace anchorsplat {

// Rejects decompression bombs: kBadFile if `raw` bytes from `compressed` bytes exceed a ratio of 200. Real data shrink
// to about a tenth.
Status CheckCompressionRatio(const std::string& where, uint64_t compressed, uint64_t raw);

}  // namespace anchorsplat
