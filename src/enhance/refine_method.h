#pragma once

#include "enhance/enhance.h"

namespace anchorsplat {

// The methods "refine" (with pictures where options.refine.images says where they are, else without) and
// "refine-images" (which is only ready with pictures), for the registry of enhance/enhance.h.
EnhanceMethod RefineMethod();
EnhanceMethod RefineImagesMethod();

}  // namespace anchorsplat
