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
      ExitCodeMeaning{kPartialExitCode, "done, but not for all inputs; of doctor: something is broken"},
      ExitCodeMeaning{kUsageExitCode, "the command line or a value on it makes no sense"},
      ExitCodeMeaning{ExitCode(ErrorCode::kNotFound), "a file or folder is not there"},
      ExitCodeMeaning{ExitCode(ErrorCode::kBadFile), "a file is malformed, truncated or of a kind that is not read"},
      ExitCodeMeaning{ExitCode(ErrorCode::kExists), "a file exists and -w was not given"},
      ExitCodeMeaning{ExitCode(ErrorCode::kIo), "the system refused to read, write or give memory"},
      ExitCodeMeaning{ExitCode(ErrorCode::kInterrupted), "interrupted"},
  };
  return meanings;
}

}  // namespace anchorsplat
