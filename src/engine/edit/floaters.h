#pragma once

#include <cstdint>
#include <span>

#include "core/buffer.h"

namespace anchorsplat {

// Floaters: Gaussians that hang in the air, apart from everything that a splat shows. They are told by how far they are
// from their neighbours, as there is no other mark of theirs: each has a size and a colour that others have, too.
//
// Let d be the distance of a Gaussian to its fourth nearest neighbour, m the median and q the upper quartile of d over
// the splat, s the standard deviation of its longest axis, r = d/s, and n the median of r. It is a floater where
//
//   d > factor · max(3, 1.6 (q/m)^2.5) · m    and    r > 0.4 (d/m)^0.6 · n
//
// The first asks for more distance where a splat is dense here and sparse there. The second leaves large Gaussians that
// lie far from others alone, as those of a sky and of a background do, for they cover the way. A clump of five is none.
// Measured in docs/benchmarks.md.
struct FloaterOptions {
  double factor = 1;  // above 0; fewer are found with a larger one
};

// For each place whether it is a floater's. `places` [N,3], all finite, in any unit; `lengths` [N] of the longest axes,
// the same unit. Memory: about 45 bytes a place. The same bits for any number of threads.
Buffer<uint8_t> FindFloaters(std::span<const float> places, std::span<const float> lengths,
                             const FloaterOptions& options);

}  // namespace anchorsplat
