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

// An input file, with the actions on it alone.
struct EditInput {
  std::filesystem::path path = {};
  std::vector<EditAction> actions = {};
};
struct EditJob {
  std::vector<EditInput> inputs = {};    // at least one; concatenated in this order
  std::vector<EditAction> actions = {};  // then applied to all together
  ConvertOptions convert = {};  // reading options apply before all actions; degree, opacity and count after them
  bool dry_run = false;         // writes nothing

  // Whether there is more to do than ConvertFile can.
  bool edits() const;
};

struct EditReport {
  ConvertReport convert;        // summed over inputs; in a dry run without what concerns writing
  std::vector<EditStep> steps;  // in order of execution
  bool streamed = false;        // no splat was in memory as a whole
};

// Reads, edits, merges and writes splats. Binary PLYs that become a PLY are streamed block by block, unless the request
// needs everything at once (--max-gaussians, --sort, --coords, reading the output back). Other files are read whole;
// what exceeds the memory limit is kept on disk (core/memory_limit.h). The result has the same bits either way.
//
// Merged splats keep the properties they all have, and are marked as partly enhanced if some are. If their render modes
// differ, the result has none. Both are warned about.
//
// Errors: those of ConvertFile and ApplyActions; kBadArgument: nothing is left. `kept`: as in ConvertFile.
Result<EditReport> EditFiles(const EditJob& job, const std::filesystem::path& output, GaussianCloud* kept = nullptr);

}  // namespace anchorsplat
