#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "edit/action.h"
#include "edit/edit_plan.h"
#include "formats/convert.h"

namespace anchorsplat {

// Splats that become one: each with the actions on it alone, then those on all of them.
struct EditInput {
  std::filesystem::path path = {};
  std::vector<EditAction> actions = {};
};
struct EditJob {
  std::vector<EditInput> inputs = {};    // at least one; their Gaussians stand one behind the other in the result
  std::vector<EditAction> actions = {};  // on all of them together, afterwards
  ConvertOptions convert = {};  // input axes and the like before all actions; degree, opacity and number behind them
  bool dry_run = false;         // nothing is written

  // Whether there is more to do than ConvertFile does.
  bool edits() const;
};

struct EditReport {
  ConvertReport convert;        // of several inputs their sums; of a dry run without what is written
  std::vector<EditStep> steps;  // in the order in which they were done
  bool streamed = false;        // no splat was in memory as a whole
};

// Reads, edits, merges and writes. Binary PLYs that become a PLY go through memory block by block, unless what is asked
// needs all of it at once (--max-gaussians, --sort, --coords, reading the output back); other files are read whole, and
// what of them is beyond the memory that there is for it lies on disk (core/memory_limit.h). The result has the same
// bits either way.
//
// Merged splats keep the properties that all of them have, and are marked as enhanced in part where some are. Where
// their render modes differ, the result has none. Both are said in a warning.
//
// Errors: those of ConvertFile and ApplyActions; kBadArgument where nothing is left. `kept` as in ConvertFile.
Result<EditReport> EditFiles(const EditJob& job, const std::filesystem::path& output, GaussianCloud* kept = nullptr);

}  // namespace anchorsplat
