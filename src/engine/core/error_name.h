#pragma once

#include "core/result.h"

namespace anchorsplat {

// What an error is called wherever programs read it, in JSON: "not_found".
const char* CodeName(ErrorCode code);

}  // namespace anchorsplat
