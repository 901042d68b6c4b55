#pragma once

#include <torch/torch.h>

#include "published/torch/level_tensors.h"
#include "published/torch/point_batch_norm.h"

namespace anchorsplat {

// Pools fine to coarse: Linear per point, maximum per cluster, BatchNorm, GELU.
class SerializedPoolingImpl : public torch::nn::Module {
 public:
  SerializedPoolingImpl(int64_t in, int64_t out);
  torch::Tensor forward(const torch::Tensor& x, const LevelTensors& fine, int64_t coarse_count);

  torch::nn::Linear proj{nullptr};
  PointBatchNorm norm{nullptr};  // norm.0
};
TORCH_MODULE(SerializedPooling);

// Unpools coarse to fine: Linear, BatchNorm and GELU on both inputs, then skip + up[cluster].
//
// Returns `skip` too: in PTv3's first release the convolution of a decoder stage's first block reads the skip branch
// alone, because the sparse tensor is filled before the addition and never updated. Published weights were trained that
// way.
class SerializedUnpoolingImpl : public torch::nn::Module {
 public:
  SerializedUnpoolingImpl(int64_t coarse, int64_t skip, int64_t out);

  struct Output {
    torch::Tensor sum;   // [N,out]
    torch::Tensor skip;  // [N,out]
  };
  Output forward(const torch::Tensor& coarse, const torch::Tensor& skip, const LevelTensors& fine);

  torch::nn::Linear proj{nullptr};       // proj.0
  PointBatchNorm norm{nullptr};          // proj.1
  torch::nn::Linear proj_skip{nullptr};  // proj_skip.0
  PointBatchNorm norm_skip{nullptr};     // proj_skip.1
};
TORCH_MODULE(SerializedUnpooling);

}  // namespace anchorsplat
