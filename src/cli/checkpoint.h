#pragma once

#include <filesystem>
#include <span>

#include "core/result.h"

namespace anchorsplat {

// Before anything is read: may this file hold the state of a run that can be resumed? `others` are what the command
// reads and writes. Errors: kBadArgument: it is one of these; kExists: it is there already, and is no checkpoint, or
// one that neither --resume nor -w speaks of; those of CheckWritable.
Status CheckCheckpoint(const std::filesystem::path& checkpoint, std::span<const std::filesystem::path> others,
                       bool resume, bool overwrite);

}  // namespace anchorsplat
