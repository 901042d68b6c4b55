#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/level.h"

namespace anchorsplat {

// One block shape of the U-Net and how many a forward pass runs.
struct BlockMix {
  int level;
  int64_t channels;
  int64_t heads;
  int64_t blocks;
};

// Encoder and decoder of the published network.
inline constexpr BlockMix kForwardMix[] = {{0, 64, 2, 2},   {1, 96, 4, 2},   {2, 128, 8, 2},
                                           {3, 256, 16, 6}, {4, 512, 32, 2}, {0, 96, 4, 2},
                                           {1, 96, 4, 2},   {2, 128, 8, 2},  {3, 256, 16, 2}};

// Voxels [N,3] of a closed surface with a hierarchy like a fitted object's: most points have their own voxel, and three
// poolings leave about a sixth of them.
std::vector<int32_t> SurfaceVoxels(int64_t count);

}  // namespace anchorsplat
