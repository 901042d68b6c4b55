#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "edit/action.h"
#include "edit/edit_plan.h"

namespace anchorsplat {

// Actions on splats [first, first + count), as if they were one.
struct EditRun {
  size_t first = 0;
  size_t count = 0;
  std::vector<EditAction> actions = {};
};

struct EditedCloud {
  GaussianCloud cloud;
  std::vector<EditStep> steps;
};

// Edits and merges splats in memory, as EditFiles does with files: applies the runs in order, then concatenates.
// `clouds` are unchanged; each remaining row is copied once. The result may be empty. Messages call the splats "the
// cloud", or "cloud 1", … if there are several.
// Errors (kBadArgument): arrays of different lengths; those of ApplyActions.
Result<EditedCloud> EditClouds(std::span<const CloudView> clouds, std::span<const EditRun> runs);

}  // namespace anchorsplat
