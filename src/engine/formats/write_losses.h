#pragma once

#include <string>
#include <vector>

#include "core/cloud_view.h"
#include "formats/registry.h"

namespace anchorsplat {

// Messages about losses in a format beyond the rounding of every cloud (docs/formats.md): dropped harmonics, clamped
// values, a render mode or credits it cannot store, means that are coarse due to their location. One sentence each;
// empty if there is no loss. WriteCloud logs them as warnings. Unusable Gaussians are not counted.
std::vector<std::string> WriteLosses(const SplatFormat& format, const CloudView& cloud);

// Largest side of the box around the middle `share` of the means on every axis, and its largest coordinate magnitude;
// estimated from at most 65,536 means. Zeros if none is usable.
struct MiddleOfMeans {
  float extent = 0, farthest = 0;  // world units
};
MiddleOfMeans FindMiddleOfMeans(const CloudView& cloud, double share = 0.98);

}  // namespace anchorsplat
