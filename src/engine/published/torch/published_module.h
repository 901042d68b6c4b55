#pragma once

#include <torch/torch.h>

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "network/weights.h"
#include "published/published_config.h"
#include "published/torch/point_transformer.h"

namespace anchorsplat {

// Heads of AnchorSplat (§3.3): per attribute a small MLP on [backbone output | input features], plus an embedding per
// copy. Outputs are residuals on the anchor in stored, normalised space: means + ε·tanh(·), others + ·.
class GaussianHeadsImpl : public torch::nn::Module {
 public:
  GaussianHeadsImpl(int64_t channels, int64_t hidden, int64_t copies);

  // Registers the parameters at the network's root, where checkpoints have them.
  void RegisterIn(torch::nn::Module& network);

  // context [n,channels], features [n,59] → [K,n,59]; copy k of all anchors precedes copy k + 1.
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

  // features [N,59] of the normalised cloud (kAttributes) → [K,N,59], same columns.
  torch::Tensor forward(const torch::Tensor& features, const Hierarchy& hierarchy, const ForwardOptions& options = {});

  // All parameters and buffers, named and ordered as in published checkpoints.
  std::vector<std::pair<std::string, torch::Tensor>> StateDict();

  const PublishedConfig config;
  PointTransformerV3 backbone{nullptr};
  GaussianHeads heads{nullptr};
};
TORCH_MODULE(AnchorSplatNetwork);

// Sets parameters and running statistics; zeroes counters. Errors: those of `source`.
Status SetWeights(AnchorSplatNetworkImpl& network, const WeightSource& source);

// Source of the network's live parameters and running statistics, for PublishedNetwork::Load. Shares ownership.
WeightSource WeightsOf(AnchorSplatNetworkImpl& network);

}  // namespace anchorsplat
