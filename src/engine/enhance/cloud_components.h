#pragma once

#include <cstdint>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Things of a splat that lie apart, as of several splats that somebody merged, or of a subject before a sky. Each may
// have been trained at pixels of its own. Of 71 fits and five captures none has more than one.
struct CloudComponents {
  static constexpr int32_t kNone = -1;

  int64_t count = 1;  // of things with half a percent of the Gaussians that show and 1,000 of them and more, or else of
                      // the largest
  Buffer<int32_t> component;  // [N], 0 ≤ … < count, the largest first; kNone for pieces that are too small for a thing
                              // and lie apart from all of them, and what shows by itself; empty where all is one
};

// Connected components of the graph that joins neighbours on the surface. Looks at the Gaussians that show, and at an
// even sample where there are many; the others belong to the thing that is nearest.
CloudComponents FindComponents(const GaussianCloud& cloud);

}  // namespace anchorsplat
