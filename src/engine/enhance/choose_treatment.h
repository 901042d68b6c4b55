#pragma once

#include "enhance/enhance.h"

namespace anchorsplat {

// Reads the splat and decides how to enhance it (reading/treatment.h). Fills pixel sizes and filter strength in `input`
// and their source in `report`, sets an untagged splat's render mode, and removes methods from `plan` that would harm
// it. Logs the choice in one sentence and warns where the user can do better.
// Errors (kBadArgument): a pixel size that is not positive, or one given along with cameras; a train width without
// cameras.
Status ChooseTreatment(const EnhanceOptions& options, MethodPlan& plan, EnhanceInput& input, EnhanceReport& report);

}  // namespace anchorsplat
