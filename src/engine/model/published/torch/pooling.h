#pragma once

#include <torch/torch.h>

#include "model/published/torch/level_tensors.h"
#include "model/published/torch/point_batch_norm.h"

namespace anchorsplat {

// Fine to coarse: Linear on every point, maximum over each cluster, then BatchNorm and GELU.
class SerializedPoolingImpl : public torch::nn::Module {
 public:
  SerializedPoolingImpl(int64_t in, int64_t out);
  torch::Tensor forward(const torch::Tensor& x, const LevelTensors& fine, int64_t coarse_count);

  torch::nn::Linear proj{nullptr};
  PointBatchNorm norm{nullptr};  // norm.0
};
TORCH_MODULE(SerializedPooling);

// Coarse to fine: both sides through Linear, BatchNorm and GELU, then skip + up[cluster].
//
// PTv3's first release writes the skip branch into the sparse tensor before the addition and never updates it, so the
// convolution of the decoder stage's first block reads `skip` alone while the residual stream is the sum. Published
// weights were trained that way.
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
