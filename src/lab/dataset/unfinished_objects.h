#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"
#include "dataset/object_record.h"

namespace anchorsplat {

// Detects objects missing from a data set whose build was killed. The build lists what is left to do in
// DATASET/.building/unfinished, one name per line, beside what it is working on.

// Replaces the list; removes the file if there are no names.
Status WriteUnfinished(const std::filesystem::path& dataset, const std::vector<std::string>& names);

struct UnfinishedObject {
  std::string name;
  bool listed = false;           // in the last build's list; else only its folder in .building exists
  std::filesystem::path folder;  // partial result; empty: not begun
};

// By name: listed objects, and those begun but not listed, left by an earlier build of other objects. Excludes
// `failures`.
// Errors: those of ReadFileBytes.
Result<std::vector<UnfinishedObject>> FindUnfinished(const std::filesystem::path& dataset,
                                                     const std::vector<ObjectFailure>& failures);

}  // namespace anchorsplat
