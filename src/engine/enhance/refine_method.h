#pragma once

#include "enhance/enhance.h"

namespace anchorsplat {

// The methods "refine" (with pictures if options.refine.images is set), "refine-images" (requires pictures) and
// "detail" (requires options.refine.enlarge_with), for the list in enhance/enhance.h.
EnhanceMethod RefineMethod();
EnhanceMethod DetailMethod();
EnhanceMethod RefineImagesMethod();

}  // namespace anchorsplat
