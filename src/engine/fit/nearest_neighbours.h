#pragma once

#include <span>

#include "core/buffer.h"

namespace anchorsplat {

// Mean squared distance of every point to its three nearest others [N], exact, by a k-d tree: structure-from-motion
// leaves lone points far away, where a grid would walk through empty cells. With fewer than three others, over those
// there are; 0 for a point alone. Positions [N,3] must be finite.
Buffer<float> MeanSquaredNeighbourDistance(std::span<const float> positions);

}  // namespace anchorsplat
