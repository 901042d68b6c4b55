#pragma once

#include <span>

#include "core/buffer.h"

namespace anchorsplat {

// Mean squared distance [N] of every point to its three nearest others (to all, if fewer; 0 for a single point). Exact,
// by a k-d tree: structure from motion leaves lone points far away, for which a grid would search many empty cells.
// `positions` [N,3] must be finite.
Buffer<float> MeanSquaredNeighbourDistance(std::span<const float> positions);

}  // namespace anchorsplat
