#pragma once

#include <torch/torch.h>

#include <string>

#include "published/torch/level_tensors.h"
#include "published/torch/serialized_attention.h"
#include "published/torch/sparse_convolution.h"

namespace anchorsplat {

// Stochastic depth: in training, zeroes each row with probability `rate` and scales the others by 1/(1 − rate) to keep
// the expectation.
torch::Tensor DropPath(const torch::Tensor& x, double rate, bool training);

class MlpImpl : public torch::nn::Module {
 public:
  MlpImpl(int64_t channels, int64_t hidden);
  torch::Tensor forward(const torch::Tensor& x) { return fc2(torch::gelu(fc1(x))); }

  torch::nn::Linear fc1{nullptr}, fc2{nullptr};
};
TORCH_MODULE(Mlp);

// Pre-norm block of PTv3: x += LN(Linear(conv(conv_in))) as conditional positional encoding, then attention and MLP as
// residual branches, each behind a LayerNorm.
class BlockImpl : public torch::nn::Module {
 public:
  BlockImpl(int64_t channels, int64_t heads, double drop_path);

  // `name`: prefix for options.tap. `conv_in`: x, except in a decoder stage's first block (see SerializedUnpooling).
  torch::Tensor forward(torch::Tensor x, const torch::Tensor& conv_in, const LevelTensors& level, int slot,
                        const ForwardOptions& options, const std::string& name);

  SubmanifoldConvolution conv{nullptr};    // cpe.0
  torch::nn::Linear cpe_linear{nullptr};   // cpe.1
  torch::nn::LayerNorm cpe_norm{nullptr};  // cpe.2
  torch::nn::LayerNorm norm1{nullptr};     // norm1.0
  SerializedAttention attention{nullptr};  // attn
  torch::nn::LayerNorm norm2{nullptr};     // norm2.0
  Mlp mlp{nullptr};                        // mlp.0

 private:
  double drop_path_;
};
TORCH_MODULE(Block);

}  // namespace anchorsplat
