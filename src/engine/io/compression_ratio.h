#pragma once

#include <cstdint>
#include <string>

#include "core/result.h"

namespace anchorsplat {

// That compressed data of `compressed` bytes may become `raw` bytes. Real data shrink to a tenth; what promises two
// hundred times its size would take memory that the file never paid for. kBadFile otherwise.
Status CheckRatio(const std::string& where, uint64_t compressed, uint64_t raw);

}  // namespace anchorsplat
