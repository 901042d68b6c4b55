#pragma once

#include "enhance/enhance.h"

namespace anchorsplat {

// Of a task with a region: marks what lies in it (EnhanceInput::inside) and gives back the rest, for which the budget
// of `within` no longer has to suffice. Without one: nothing. kBadArgument: no Gaussian lies in the region; the rest
// alone is more than the budget.
Result<GaussianCloud> SetRestAside(const EnhanceOptions& options, EnhanceInput& input, EnhanceOptions& within,
                                   EnhanceReport& report);

// For methods that look at no others: leaves those inside.
void LeaveRegion(EnhanceInput& input);

}  // namespace anchorsplat
