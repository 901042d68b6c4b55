#pragma once

#include "core/result.h"
#include "enhance/refine.h"
#include "enhance/refine_views.h"

namespace anchorsplat {

// The parts of the plan that depend on what is asked alone. kBadArgument: options that cannot be run, options about
// photographs without photographs.
Result<RefineOptions> ChooseRefineOptions(const RefineInput& input, const RefineOptions& given);

// Leaves as many of all but the last `fixed` Gaussians as there may be, those of the largest opacity × size; 0: no
// bound. How many went.
int64_t KeepToBudget(int64_t max_gaussians, int64_t fixed, GaussianCloud& start);

// The rest: looks at the views. `as_it_is` is the input as refinement could begin with it: within its bound. What
// `resumes` is not split, so that nothing is measured for that. Errors: those of MeasureConsistency, MeasureDensity and
// Residuals.
Result<RefinePlan> PlanRefinement(const RefineInput& input, const GaussianCloud& as_it_is, const RefineOptions& chosen,
                                  bool resumes, RefineViews& views);

}  // namespace anchorsplat
