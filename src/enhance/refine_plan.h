#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "enhance/refine.h"
#include "enhance/refine_views.h"

namespace anchorsplat {

// What a refinement is going to do, decided before anything is optimised.
struct RefinePlan {
  RefineOptions options;       // steps (unless it runs for seconds), copies and rate are chosen
  bool from_input = false;     // it begins with the splat as it was fitted, not with the start that it was given
  bool nothing_to_do = false;  // the start shows what the splat does already
  double before = 0;           // dB, of what it begins with
  // dB that it has to gain, or else the start is kept. More than 0 for a splat that may know more than the pictures
  // show.
  double least_gain = 0;
  std::string why;  // for people; empty where there is nothing special
};

// The parts of the plan that depend on what is asked alone. kBadArgument: options that cannot be run, options about
// photographs without photographs.
Result<RefineOptions> ChooseRefineOptions(const RefineInput& input, const RefineOptions& given);

// The rest: looks at the views. Errors: those of MeasureConsistency and MeasureDensity.
Result<RefinePlan> PlanRefinement(const RefineInput& input, const RefineOptions& chosen, RefineViews& views);

// The Gaussians that the iterations begin with: K for each of `start`, with pictures more where these find more wrong.
Result<GaussianCloud> SplitForRefinement(const GaussianCloud& start, const RefineInput& input, const RefinePlan& plan,
                                         RefineViews& views);

}  // namespace anchorsplat
