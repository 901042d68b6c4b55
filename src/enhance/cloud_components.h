#pragma once

#include <cstdint>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Things of a splat that lie apart, as of several splats that somebody merged, or of a subject before a sky. Each may
// have been trained at pixels of its own. Of 22 fits and five captures none has more than one.
struct CloudComponents {
  int64_t count = 1;          // of things with half a percent of the Gaussians that show and 1,000 of them and more
  Buffer<int32_t> component;  // [N], 0 ≤ … < count, the largest first; empty where there is only one. What belongs to
                              // none, as floaters, is counted to the nearest
};

// Connected components of the graph that joins neighbours on the surface. Looks at the Gaussians that show, and at an
// even sample where there are many.
CloudComponents FindComponents(const GaussianCloud& cloud);

}  // namespace anchorsplat
