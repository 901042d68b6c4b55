#pragma once

#include "enhance/enhance.h"

namespace anchorsplat {

// The methods "refine" (with pictures where options.refine.images says where they are, else without), "refine-images"
// (which is only ready with pictures) and "detail" (which is only ready with options.refine.enlarge_with), for the
// registry of enhance/enhance.h.
EnhanceMethod RefineMethod();
EnhanceMethod DetailMethod();
EnhanceMethod RefineImagesMethod();

}  // namespace anchorsplat
