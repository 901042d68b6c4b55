#pragma once

#include <vector>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "edit/action.h"
#include "web/request.h"

namespace anchorsplat::web {

// What a request asks to be done to a splat, by its words, in their order.
struct Edits {
  std::vector<EditAction> actions;
  bool count_only = false;  // --dry-run
};
// Errors: kBadArgument with the word.
Result<Edits> EditsOf(const Json& request);

struct Edited {
  GaussianCloud cloud;
  Json report;  // {"actions": what each took away, "world": {"rotation": row-major, "translation", "scale"}}
};
// Errors: those of EditClouds; kBadArgument where nothing is left.
Result<Edited> EditCloud(const GaussianCloud& cloud, const std::vector<EditAction>& actions);

// What each would take away, which may be all. Errors: those of ApplyActions.
Result<Json> CountEdits(const GaussianCloud& cloud, const std::vector<EditAction>& actions);

}  // namespace anchorsplat::web
