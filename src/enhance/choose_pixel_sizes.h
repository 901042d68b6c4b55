#pragma once

#include "core/result.h"
#include "enhance/enhance.h"

namespace anchorsplat {

// Fills the pixel sizes of `input` and what the report says of them: those that are given, those of the cameras or,
// with `pictures`, of the cameras that took these, else the size that is estimated. Warns where cameras and splat do
// not agree; cameras whose pixels the splat cannot have had are not believed. `says`: whether what is found matters to
// the user, as there is width to give back. Errors: those of Enhance that are about cameras and sizes.
Status ChoosePixelSizes(const EnhanceOptions& options, bool pictures, bool says, EnhanceInput& input,
                        EnhanceReport& report);

}  // namespace anchorsplat
