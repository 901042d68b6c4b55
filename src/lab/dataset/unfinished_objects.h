#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"
#include "dataset/object_record.h"

namespace anchorsplat {

// Whoever kills a build gets a data set that is whole object by object, and yet not what was asked for. The build keeps
// a list of what it still has to make beside what it is making: DATASET/.building/unfinished, a name a line.

// Replaces the list; without names the file goes.
Status WriteUnfinished(const std::filesystem::path& dataset, const std::vector<std::string>& names);

struct UnfinishedObject {
  std::string name;
  bool listed = false;           // the last build was to make it; else only its folder in .building tells
  std::filesystem::path folder;  // what there is of it; empty: it was not begun
};

// By name: what is on the list, and what was begun and is on none, as an earlier build of other objects left it. Not
// what `failures` knows. Errors: those of ReadFileBytes.
Result<std::vector<UnfinishedObject>> FindUnfinished(const std::filesystem::path& dataset,
                                                     const std::vector<ObjectFailure>& failures);

}  // namespace anchorsplat
