#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "compact/compact_config.h"
#include "core/buffer.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Neighbours and local frame of every Gaussian.
//
// A frame's axes are the Gaussian's own, longest first; axes of equal length keep their stored order. Signs are chosen
// so that the sum of the unit vectors to the neighbours has no negative component. Frames therefore move, rotate and
// mirror with the splat, and coordinates in them are invariant. A frame may be left-handed.
struct CompactGraph {
  int64_t count = 0;            // N
  int64_t neighbours = 0;       // m = min(M, N − 1)
  Buffer<int32_t> index;        // [N,m] neighbours, nearest first
  Buffer<float> axes;           // [N,3,3] axis a of Gaussian i as a unit vector, world
  Buffer<uint8_t> stored_axis;  // [N,3] the axis's index in the stored scales and quaternion
  Buffer<float> sidedness;      // [N,3] mean of the unit vectors to the neighbours along each axis, 0–1

  const float* axis(int64_t i, int64_t a) const { return axes.data() + 9 * i + 3 * a; }
};

// Neighbours without frames, for working through space block by block. Places number the Gaussians in a spatially
// coherent order.
struct CompactNeighbours {
  int64_t neighbours = 0;  // m = min(M, N − 1)
  Buffer<int32_t> rows;    // [N] Gaussian at each place
  Buffer<int32_t> index;   // [N,m] places of its neighbours, nearest first
};
CompactNeighbours FindCompactNeighbours(const GaussianCloud& cloud, int64_t neighbours,
                                        CompactContext context = CompactContext::kNearest);

// Values must be finite except log-scales of −Inf; fewer than 2^31 Gaussians. The same bits for any number of threads.
CompactGraph BuildCompactGraph(const GaussianCloud& cloud, int64_t neighbours,
                               CompactContext context = CompactContext::kNearest);

// As BuildCompactGraph, with known neighbours `index` [N,m]. A neighbour at the same position does not affect the
// frame.
CompactGraph GraphOfNeighbours(const GaussianCloud& cloud, int64_t neighbours, Buffer<int32_t> index);

}  // namespace anchorsplat
