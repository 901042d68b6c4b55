#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "core/result.h"
#include "io/file_lock.h"

namespace anchorsplat {

// Before any work: may this file hold the state of a run that can be resumed? Errors: kBadArgument: it is an input, or
// one of the command's `outputs`; kExists: it is there already, and is no checkpoint, or one that neither --resume nor
// -w speaks of; those of CheckWritable. `is_checkpoint` tells what is one; empty: IsFitCheckpoint.
Status CheckCheckpoint(const std::filesystem::path& checkpoint, std::span<const std::filesystem::path> outputs,
                       bool resume, bool overwrite,
                       const std::function<bool(const std::filesystem::path&)>& is_checkpoint = {});

// Whether a checkpoint is of a run with these settings, each of the two a JSON object of one level. kBadArgument: of
// another one, with the name of what differs; kBadFile: of a version that knew less.
Status CompareSettings(const std::string& file, const std::string& theirs, const std::string& ours);

// When the result is safe. What is no such checkpoint stays.
void RemoveCheckpoint(const std::filesystem::path& checkpoint, bool (*is_checkpoint)(const std::filesystem::path&));

// Before a run goes on from this checkpoint: what its interruption left under these names is the command's own, to be
// replaced without -w. What has the name of another output is not.
void RecordWhatWasLeft(const std::filesystem::path& checkpoint, std::span<const std::filesystem::path> outputs);

// For as long as a run may write this checkpoint; nothing where `checkpoint` is empty. kExists: another run is at work.
Result<std::optional<FileLock>> HoldCheckpoint(const std::filesystem::path& checkpoint);

}  // namespace anchorsplat
