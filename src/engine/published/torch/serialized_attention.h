#pragma once

#include <torch/torch.h>

#include "published/torch/forward_options.h"
#include "published/torch/level_tensors.h"

namespace anchorsplat {

// Multi-head attention within patches of consecutive points along a curve (PTv3, §4.3). `qkv` yields [q | k | v]; head
// h owns C/H consecutive channels of each. Scores are scaled by (C/H)^(−1/2).
class SerializedAttentionImpl : public torch::nn::Module {
 public:
  SerializedAttentionImpl(int64_t channels, int64_t heads);

  // x [N,C] → [N,C]. `slot`: which of the level's four orders.
  torch::Tensor forward(const torch::Tensor& x, const LevelTensors& level, int slot, AttentionRounding rounding);

  torch::nn::Linear qkv{nullptr}, proj{nullptr};

 private:
  int64_t heads_;
};
TORCH_MODULE(SerializedAttention);

}  // namespace anchorsplat
