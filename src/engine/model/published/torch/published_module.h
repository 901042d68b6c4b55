#pragma once

#include <torch/torch.h>

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "model/published/published_config.h"
#include "model/published/torch/point_transformer.h"
#include "model/shared/weights.h"

namespace anchorsplat {

// One small MLP per attribute over [backbone output | input features], and an embedding per copy (AnchorSplat, §3.3).
// Everything is a residual on the anchor in stored, normalised space: means + ε·tanh(·), the others + ·.
class GaussianHeadsImpl : public torch::nn::Module {
 public:
  GaussianHeadsImpl(int64_t channels, int64_t hidden, int64_t copies);

  // Parameters are registered in the network itself, because checkpoints have them at its root.
  void RegisterIn(torch::nn::Module& network);

  // context [n,channels], features [n,59] → [K,n,59]: copy k of all anchors before copy k + 1.
  torch::Tensor forward(const torch::Tensor& context, const torch::Tensor& features);

  std::array<std::array<torch::nn::Linear, 4>, 6> layers = {{{nullptr, nullptr, nullptr, nullptr},
                                                             {nullptr, nullptr, nullptr, nullptr},
                                                             {nullptr, nullptr, nullptr, nullptr},
                                                             {nullptr, nullptr, nullptr, nullptr},
                                                             {nullptr, nullptr, nullptr, nullptr},
                                                             {nullptr, nullptr, nullptr, nullptr}}};
  std::array<torch::Tensor, 6> embeddings;  // [K,channels of the attribute]

 private:
  int64_t copies_;
};
TORCH_MODULE(GaussianHeads);

// AnchorSplat: N anchors in, K·N Gaussians out.
class AnchorSplatNetworkImpl : public torch::nn::Module {
 public:
  explicit AnchorSplatNetworkImpl(const PublishedConfig& config);  // must be valid

  // features [N,59] of the normalised cloud (see kAttributes) → [K,N,59] in the same columns.
  torch::Tensor forward(const torch::Tensor& features, const Hierarchy& hierarchy, const ForwardOptions& options = {});

  // All parameters and buffers in the order and under the names of published checkpoints.
  std::vector<std::pair<std::string, torch::Tensor>> StateDict();

  const PublishedConfig config;
  PointTransformerV3 backbone{nullptr};
  GaussianHeads heads{nullptr};
};
TORCH_MODULE(AnchorSplatNetwork);

// Fills parameters and running statistics; counters become zero. Errors are those of `source`.
Status SetWeights(AnchorSplatNetworkImpl& network, const WeightSource& source);

// The network's parameters and running statistics as they are now or later, for PublishedNetwork::Load. Shares them.
WeightSource WeightsOf(AnchorSplatNetworkImpl& network);

}  // namespace anchorsplat
