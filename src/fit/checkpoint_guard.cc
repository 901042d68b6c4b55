#include "fit/checkpoint_guard.h"

#include <algorithm>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "core/file_system.h"
#include "core/text.h"
#include "fit/fitter.h"
#include "io/atomic_file.h"
#include "io/input_record.h"

namespace anchorsplat {

namespace fs = std::filesystem;

namespace {

bool SamePlace(const fs::path& a, const fs::path& b) {
  std::error_code code;
  return AbsoluteName(a) == AbsoluteName(b) || fs::equivalent(a, b, code);
}

}  // namespace

Status CheckCheckpoint(const fs::path& checkpoint, std::span<const fs::path> outputs, bool resume, bool overwrite) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckIsNoInput(checkpoint));
  for (const fs::path& output : outputs) {
    if (!output.empty() && SamePlace(output, checkpoint)) {
      return Error{ErrorCode::kBadArgument, Cat("--checkpoint ", checkpoint.string(), ": is the output itself")};
    }
  }
  ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(checkpoint));
  if (!Exists(checkpoint) || resume) return {};  // what a checkpoint is, reading it shows
  if (!IsFitCheckpoint(checkpoint)) {
    return Error{ErrorCode::kExists,
                 Cat(checkpoint.string(),
                     " is there and is no checkpoint; name a file with --checkpoint for what an interruption leaves")};
  }
  if (overwrite) return {};
  return Error{ErrorCode::kExists, Cat(checkpoint.string(),
                                       " is left from a run that was interrupted: --resume goes on from it, -w begins "
                                       "anew")};
}

void RecordWhatWasLeft(const fs::path& checkpoint, std::span<const fs::path> outputs) {
  const std::vector<std::string> left = FilesLeftWith(checkpoint);
  for (const fs::path& output : outputs) {
    if (std::find(left.begin(), left.end(), AbsoluteName(output)) != left.end()) RecordOwnFile(output);
  }
}

Result<std::optional<FileLock>> HoldCheckpoint(const fs::path& checkpoint) {
  if (checkpoint.empty()) return std::optional<FileLock>();
  auto lock = FileLock::TakeAndRemove(checkpoint.string() + ".lock");
  if (lock.ok()) return std::optional<FileLock>(*std::move(lock));
  if (lock.error().code != ErrorCode::kExists) return lock.error();
  return Error{ErrorCode::kExists, Cat(checkpoint.string(),
                                       ": another run that keeps its state there is at work; give this one another "
                                       "output, or another --checkpoint")};
}

}  // namespace anchorsplat
