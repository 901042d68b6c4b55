#pragma once

#include <cstdint>
#include <span>

#include "core/buffer.h"

namespace anchorsplat {

// Offsets of a 3×3×3 convolution: k = (dx + 1)·9 + (dy + 1)·3 + (dz + 1). The centre is 13; k and 26 − k are opposite.
inline constexpr int kNeighbours = 27;
inline constexpr int kCentre = 13;
inline constexpr int32_t kNoNeighbour = -1;

// Rows [N,27] that a submanifold 3×3×3 convolution reads at each offset for points at voxels [N,3] (coordinates 0 …
// 2^20); kNoNeighbour where there is none.
//
// Points may share a voxel before the first pooling. spconv 2.3.6 keeps one *winner* per voxel in a hash table, filled
// from every point's first 13 offsets and mirrored from the winners; both are data races. This deterministic form takes
// the largest row as the winner:
//   - the centre is the point itself,
//   - offsets 0–12 read the winner of the neighbouring voxel,
//   - offsets 14–26 do the same for the winner of its own voxel, and are absent for all other points.
Buffer<int32_t> VoxelNeighbours(std::span<const int32_t> voxels);

}  // namespace anchorsplat
