#pragma once

#include <torch/torch.h>

#include "published/torch/level_tensors.h"

namespace anchorsplat {

// Submanifold 3×3×3 convolution (Graham et al. 2018): outputs exist where inputs do; absent voxels contribute nothing.
// weight [out,3,3,3,in] and bias [out] as in spconv: weight[:,r0,r1,r2,:] applies to offset (r0 − 1, r1 − 1, r2 − 1)
// along (x, y, z). For points that share a voxel see VoxelNeighbours.
//
// Initialised like spconv: Kaiming-uniform with a = √5 and fan_in = 27·in, bias uniform in ±1/√fan_in.
class SubmanifoldConvolutionImpl : public torch::nn::Module {
 public:
  SubmanifoldConvolutionImpl(int64_t in, int64_t out);
  void reset();
  torch::Tensor forward(const torch::Tensor& x, const LevelTensors& level);  // [N,in] → [N,out]

  torch::Tensor weight, bias;
};
TORCH_MODULE(SubmanifoldConvolution);

}  // namespace anchorsplat
