#pragma once

#include "enhance/enhance.h"

namespace anchorsplat {

// Reads the splat and decides what to do with it (reading/treatment.h): fills the widths of `input` and what `report`
// says of them, gives an untagged splat the render mode that it is taken to have, and leaves methods out of `plan` that
// would harm it. Says in one sentence what was chosen, and warns where the user can do better. `gives_width`: false
// where the splat stays as wide as it is. kBadArgument: a pixel size that is no positive length, or is given beside
// cameras; a train width without them.
Status ChooseTreatment(const EnhanceOptions& options, MethodPlan& plan, EnhanceInput& input, EnhanceReport& report);

}  // namespace anchorsplat
