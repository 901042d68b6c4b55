#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "core/result.h"
#include "io/file_lock.h"

namespace anchorsplat {

// Checks, before any work, that this file may hold a run's state. Errors: kBadArgument: it is an input or one of the
// command's `outputs`; kExists: it exists and is no checkpoint, or a checkpoint without --resume or -w; those of
// CheckWritable. `is_checkpoint`: recognises one; empty: IsFitCheckpoint.
Status CheckCheckpoint(const std::filesystem::path& checkpoint, std::span<const std::filesystem::path> outputs,
                       bool resume, bool overwrite,
                       const std::function<bool(const std::filesystem::path&)>& is_checkpoint = {});

// Checks that a checkpoint (`theirs`) belongs to a run with settings `ours`, both flat JSON objects. kBadArgument: it
// does not, naming the difference; kBadFile: an older version lacks a setting.
Status CompareSettings(const std::string& file, const std::string& theirs, const std::string& ours);

// Deletes the checkpoint, once the result is safe. Leaves files that `is_checkpoint` rejects.
void RemoveCheckpoint(const std::filesystem::path& checkpoint, bool (*is_checkpoint)(const std::filesystem::path&));

// Before resuming: registers the interrupted run's files at `outputs` as the command's own, replaceable without -w.
// Other files are not registered.
void RecordWhatWasLeft(const std::filesystem::path& checkpoint, std::span<const std::filesystem::path> outputs);

// Locks the checkpoint for a run; unset if `checkpoint` is empty. kExists: another run holds it.
Result<std::optional<FileLock>> HoldCheckpoint(const std::filesystem::path& checkpoint);

}  // namespace anchorsplat
