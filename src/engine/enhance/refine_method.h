#pragma once

#include "enhance/enhance.h"

namespace anchorsplat {

// The methods "refine" (with pictures if options.refine.images is set), "refine-images" (requires pictures) and
// "detail" (against enlarged views, with a network if options.refine.enlarge_with is set), for the list in
// enhance/enhance.h.
EnhanceMethod RefineMethod();
EnhanceMethod DetailMethod();
EnhanceMethod RefineImagesMethod();

// Whether "detail" supports this zoom: whole numbers from 1 to kMostSamples.
bool CanEnlarge(double upscale);

}  // namespace anchorsplat
