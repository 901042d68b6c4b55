#pragma once

#include <span>

#include "core/error_name.h"
#include "core/result.h"

namespace anchorsplat {

// Exit code of the program, one per kind of failure (docs/cli.md). 0 is success.
int ExitCode(ErrorCode code);

inline constexpr int kPartialExitCode = 1;  // done, but not for all inputs; messages and results say for which
inline constexpr int kUsageExitCode = 2;

// All codes with descriptions, 0 first.
struct ExitCodeMeaning {
  int code;
  const char* meaning;
};
std::span<const ExitCodeMeaning> ExitCodeMeanings();

}  // namespace anchorsplat
