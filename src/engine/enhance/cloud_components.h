#pragma once

#include <cstdint>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Separate components of a splat, as when several were merged, or a subject in front of a sky. Each may have its own
// training pixel. None of 71 fits of objects has more than one, half of the captures do.
struct CloudComponents {
  static constexpr int32_t kNone = -1;

  // Components with at least 1,000 visible Gaussians and half a percent of them all; at least 1, the largest.
  int64_t count = 1;
  // [N] 0 ≤ … < count, the largest first; empty if there is one. kNone: pieces too small to count that lie apart from
  // all components, and single visible Gaussians.
  Buffer<int32_t> component;
};

// Connected components of the neighbour graph on the surface. Uses the visible Gaussians, an even sample if there are
// many; each other Gaussian joins the nearest component.
CloudComponents FindComponents(const GaussianCloud& cloud);

}  // namespace anchorsplat
