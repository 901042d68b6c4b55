#pragma once

#include <cstdint>

#include "kernels/packed_weights.h"

namespace anchorsplat {

// Submanifold 3×3×3 convolution (Graham et al. 2018): out[i] = b + Σ_k W_k · input[neighbours[i,k]] over existing
// neighbours, k ascending.
struct SparseConvolutionParams {
  int64_t count;                 // N points
  const float* input;            // [N, weights.inputs()]
  const int32_t* neighbours;     // [N,27] rows or kNoNeighbour (voxel_neighbours.h)
  const PackedWeights* weights;  // 27 taps; a module's [out, kx, ky, kz, in] is [out, 27, in]
  // out
  float* out;  // [N, weights.outputs()]; must not overlap `input`
};
// The same bits for any number of threads. Gathers inputs per tile, so the 27-fold copy never exists.
void SparseConvolutionCpu(const SparseConvolutionParams& p);

}  // namespace anchorsplat
