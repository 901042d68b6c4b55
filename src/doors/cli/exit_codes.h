#pragma once

#include <span>

#include "core/error_name.h"
#include "core/result.h"

namespace anchorsplat {

// What the program returns to the shell; each kind of failure has a number of its own (docs/cli.md). 0 is success.
int ExitCode(ErrorCode code);

inline constexpr int kPartialExitCode = 1;  // done, but not for all inputs; messages and results say for which
inline constexpr int kUsageExitCode = 2;

// All of them for people, 0 first.
struct ExitCodeMeaning {
  int code;
  const char* meaning;
};
std::span<const ExitCodeMeaning> ExitCodeMeanings();

}  // namespace anchorsplat
