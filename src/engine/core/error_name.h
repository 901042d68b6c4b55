#pragma once

#include "core/result.h"

namespace anchorsplat {

// Name of an error code in JSON, for example "not_found".
const char* CodeName(ErrorCode code);

}  // namespace anchorsplat
