#pragma once

#include "enhance/enhance.h"

namespace anchorsplat {

// With options.region: marks the Gaussians inside (EnhanceInput::in_region), reduces the budget of `within` by the
// others, and returns those others. Without: returns an empty cloud. kBadArgument: the region is empty; the others
// alone exceed the budget.
Result<GaussianCloud> SplitOffOutside(const EnhanceOptions& options, EnhanceInput& input, EnhanceOptions& within,
                                      EnhanceReport& report);

// Removes Gaussians outside the region, for methods that do not use them as context.
void KeepOnlyRegion(EnhanceInput& input);

}  // namespace anchorsplat
