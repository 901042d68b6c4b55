#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "model/compact/compact_config.h"

namespace anchorsplat {

// Which Gaussians a Gaussian hears from, and the frame in which it sees them.
//
// A Gaussian's own frame are its three axes, longest first; of axes of one length the one stored first comes first. An
// axis points to the side on which the neighbours lie: the sum of the directions to them has no negative component. So
// the frame turns, moves and mirrors with the splat, and what is expressed in it does not change. It may be
// left-handed.
struct CompactGraph {
  int64_t count = 0;            // N
  int64_t neighbours = 0;       // m = min(M, N − 1)
  Buffer<int32_t> index;        // [N,m] by rising distance
  Buffer<float> axes;           // [N,3,3] axis a of Gaussian i as a unit vector, world
  Buffer<uint8_t> stored_axis;  // [N,3] which axis of the stored scales and of the quaternion it is
  Buffer<float> sidedness;      // [N,3] mean of the unit vectors to the neighbours along each axis, 0–1

  const float* axis(int64_t i, int64_t a) const { return axes.data() + 9 * i + 3 * a; }
};

// The same neighbours without frames, for whoever works on one part of space after the other. A Gaussian's place is
// that in an order in which near ones are near.
struct CompactNeighbours {
  int64_t neighbours = 0;  // m = min(M, N − 1)
  Buffer<int32_t> rows;    // [N] the Gaussian at each place
  Buffer<int32_t> index;   // [N,m] places of the neighbours of the Gaussian at each place, by rising distance
};
CompactNeighbours FindCompactNeighbours(const GaussianCloud& cloud, int64_t neighbours,
                                        CompactContext context = CompactContext::kNearest);

// The cloud's values must be finite but for log-scales of −Inf; fewer than 2^31 Gaussians. The same bits for any number
// of threads.
CompactGraph BuildCompactGraph(const GaussianCloud& cloud, int64_t neighbours,
                               CompactContext context = CompactContext::kNearest);

// The same where the neighbours are known: `index` [N,m]. A neighbour in a Gaussian's own place counts as none for its
// frame.
CompactGraph GraphOfNeighbours(const GaussianCloud& cloud, int64_t neighbours, Buffer<int32_t> index);

}  // namespace anchorsplat
