#include "cli/checkpoint.h"

#include <system_error>

#include "core/text.h"
#include "fit/fitter.h"
#include "formats/atomic_file.h"
#include "formats/opened_splat.h"

namespace anchorsplat {

namespace fs = std::filesystem;

namespace {

bool SamePlace(const fs::path& a, const fs::path& b) {
  return fs::absolute(a).lexically_normal() == fs::absolute(b).lexically_normal();
}

}  // namespace

Status CheckCheckpoint(const fs::path& checkpoint, std::span<const fs::path> others, bool resume, bool overwrite) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckInputsStay(others, {&checkpoint, 1}));
  for (const fs::path& other : others) {
    if (!other.empty() && SamePlace(other, checkpoint)) {
      return Error{ErrorCode::kBadArgument, Cat("--checkpoint ", checkpoint.string(), ": is the output itself")};
    }
  }
  ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(checkpoint));
  std::error_code ignored;
  if (!fs::exists(checkpoint, ignored) || resume) return {};  // what a checkpoint is, reading it shows
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

}  // namespace anchorsplat
