#pragma once

#include "core/result.h"
#include "enhance/refine.h"
#include "enhance/refine_views.h"

namespace anchorsplat {

// Chooses the options that depend on the request alone. Errors (kBadArgument): options that cannot be run; picture
// options without pictures.
Result<RefineOptions> ChooseRefineOptions(const RefineInput& input, const RefineOptions& given);

// Reduces all but the last `fixed` Gaussians to fit `max_gaussians`, keeping the largest opacity × size; 0: no limit.
// Returns how many were dropped.
int64_t KeepToBudget(int64_t max_gaussians, int64_t fixed, GaussianCloud& start);

// Completes the plan by measuring the views. `as_it_is`: the input, within its limit, as a possible start. `resumes`: a
// checkpoint provides the Gaussians, so splitting is not planned. Errors: those of MeasureConsistency, MeasureDensity
// and Residuals.
Result<RefinePlan> PlanRefinement(const RefineInput& input, const GaussianCloud& as_it_is, const RefineOptions& chosen,
                                  bool resumes, RefineViews& views);

}  // namespace anchorsplat
