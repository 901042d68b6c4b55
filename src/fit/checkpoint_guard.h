#pragma once

#include <filesystem>
#include <optional>
#include <span>

#include "core/result.h"
#include "io/file_lock.h"

namespace anchorsplat {

// Before any work: may this file hold the state of a run that can be resumed? Errors: kBadArgument: it is an input, or
// one of the command's `outputs`; kExists: it is there already, and is no checkpoint, or one that neither --resume nor
// -w speaks of; those of CheckWritable.
Status CheckCheckpoint(const std::filesystem::path& checkpoint, std::span<const std::filesystem::path> outputs,
                       bool resume, bool overwrite);

// Before a run goes on from this checkpoint: what its interruption left under these names is the command's own, to be
// replaced without -w. What has the name of another output is not.
void RecordWhatWasLeft(const std::filesystem::path& checkpoint, std::span<const std::filesystem::path> outputs);

// For as long as a run may write this checkpoint; nothing where `checkpoint` is empty. kExists: another run is at work.
Result<std::optional<FileLock>> HoldCheckpoint(const std::filesystem::path& checkpoint);

}  // namespace anchorsplat
