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

// Actions on the splats [first, first + count) of several, as if these were one.
struct EditRun {
  size_t first = 0;
  size_t count = 0;
  std::vector<EditAction> actions = {};
};

struct EditedCloud {
  GaussianCloud cloud;
  std::vector<EditStep> steps;
};

// Splats in memory that become one, as EditFiles makes one of files: the runs in their order, then the Gaussians of one
// splat behind those of the other. `clouds` stay as they are; each row that is left is copied once. The result may have
// no Gaussians. In messages and reports they are "the cloud", or "cloud 1" and on where there are several.
// Errors (kBadArgument): arrays that disagree, those of ApplyActions.
Result<EditedCloud> EditClouds(std::span<const CloudView> clouds, std::span<const EditRun> runs);

}  // namespace anchorsplat
