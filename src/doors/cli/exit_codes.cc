#include "cli/exit_codes.h"

#include <array>

namespace anchorsplat {

int ExitCode(ErrorCode code) {
  switch (code) {
    case ErrorCode::kBadArgument:
      return kUsageExitCode;
    case ErrorCode::kNotFound:
      return 3;
    case ErrorCode::kBadFile:
      return 4;
    case ErrorCode::kExists:
      return 5;
    case ErrorCode::kIo:
      return 6;
    case ErrorCode::kInterrupted:
      return 130;
  }
  return 1;
}

std::span<const ExitCodeMeaning> ExitCodeMeanings() {
  static const std::array meanings = {
      ExitCodeMeaning{0, "done"},
      ExitCodeMeaning{kPartialExitCode, "done for some inputs only; doctor: a part is broken"},
      ExitCodeMeaning{kUsageExitCode, "invalid command line or value"},
      ExitCodeMeaning{ExitCode(ErrorCode::kNotFound), "file or folder not found"},
      ExitCodeMeaning{ExitCode(ErrorCode::kBadFile), "malformed, truncated or unsupported file"},
      ExitCodeMeaning{ExitCode(ErrorCode::kExists), "file exists and -w was not given"},
      ExitCodeMeaning{ExitCode(ErrorCode::kIo), "reading, writing or memory allocation failed"},
      ExitCodeMeaning{ExitCode(ErrorCode::kInterrupted), "interrupted"},
  };
  return meanings;
}

}  // namespace anchorsplat
