#pragma once

#include <vector>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "edit/action.h"
#include "web/request.h"

namespace anchorsplat::web {

// The edits of a request, in order.
struct Edits {
  std::vector<EditAction> actions;
  bool count_only = false;  // --dry-run
};
// Errors: kBadArgument with the word.
Result<Edits> EditsOf(const Json& request);

struct Edited {
  GaussianCloud cloud;
  Json report;  // {"actions": what each removed, "world": {"rotation": row-major, "translation", "scale"}}
};
// Errors: those of EditClouds; kBadArgument if nothing is left.
Result<Edited> EditCloud(const GaussianCloud& cloud, const std::vector<EditAction>& actions);

// What each would remove, which may be everything. Errors: those of ApplyActions.
Result<Json> CountEdits(const GaussianCloud& cloud, const std::vector<EditAction>& actions);

}  // namespace anchorsplat::web
