#pragma once

#include <cstdint>
#include <span>

#include "core/buffer.h"

namespace anchorsplat {

// Floaters: Gaussians that hang in the air, apart from everything else. Only their distance from neighbours gives them
// away: their sizes and colours are common.
//
// Let d be a Gaussian's distance to its fourth nearest neighbour, m the median and q the upper quartile of d over the
// splat, s the standard deviation of its longest axis, r = d/s, and n the median of r. It is a floater if
//
//   d > factor · max(3, 1.6 (q/m)^2.5) · m    and    r > 0.4 (d/m)^0.6 · n
//
// The first condition demands more distance in splats of uneven density. The second spares large distant Gaussians,
// such as sky and background, which bridge the distance. A clump of five is not a floater. Measured in
// docs/benchmarks.md.
struct FloaterOptions {
  double factor = 1;  // > 0; larger values find fewer
};

// 1 for each floater. `places` [N,3], finite; `lengths` [N] longest axes, same unit. Memory: about 45 bytes per place.
// The same bits for any number of threads.
Buffer<uint8_t> FindFloaters(std::span<const float> places, std::span<const float> lengths,
                             const FloaterOptions& options);

}  // namespace anchorsplat
