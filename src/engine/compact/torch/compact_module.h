#pragma once

#include <torch/torch.h>

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "compact/compact_config.h"
#include "compact/compact_start.h"
#include "network/torch/trainable_network.h"
#include "network/weights.h"

namespace anchorsplat {

// A compact network (compact/compact_config.h) for training. Prepare computes neighbours, frames and features
// once per splat with inference's code; they do not depend on parameters.
class CompactTrainable : public TrainableNetwork {
 public:
  explicit CompactTrainable(const CompactConfig& config);  // must be valid

  // Computes features on the CPU and moves them to the splat's device. Errors (kBadArgument): no Gaussians; non-finite
  // values (except −Inf log-scales and opacity logits); pixel sizes that are not positive.
  Result<std::shared_ptr<void>> Prepare(const NetworkInput& input) override;

  // Parts keep the neighbours of the whole splat and record its feature range as surveyed. Errors besides those of
  // Prepare: OffsetUnit::kCube, which needs the whole splat.
  Result<std::shared_ptr<const void>> Survey(const NetworkInput& whole) override;
  SplatPart PartOf(const std::shared_ptr<const void>& survey, std::span<const int64_t> wanted) override;

  // In training, also widens the recorded feature range (buffers "domain.low" and "domain.high"): per feature, the
  // most extreme 0.5 % and 99.5 % quantiles of any splat.
  GaussianTensors Forward(const NetworkInput& input) override;

  void ShareMemory(const std::function<void(torch::Tensor&)>& maximum) override;

  int copies() const override { return static_cast<int>(config_.copies); }
  std::vector<std::pair<std::string, std::vector<torch::Tensor>>> Groups() override;
  Status Save(const std::filesystem::path& path, const std::map<std::string, std::string>& metadata) override;

  const CompactConfig& config() const { return config_; }

  // Raw outputs [N, CompactOutputs(config())], for a part those of its wanted Gaussians. Order as
  // CompactNetwork::Outputs.
  torch::Tensor Outputs(const NetworkInput& input);

  // Sets parameters and buffers. Errors: those of `source`.
  Status SetWeights(const WeightSource& source);
  // Source of the live parameters and buffers, for CompactNetwork::Load. Shares ownership.
  WeightSource Weights();

  // Starts from another network's weights and feature range. Copies tensors of equal name and shape. Output layers for
  // another number of copies start as that network's first copy; layers with fewer inputs are extended by zero weights.
  // Errors: those of reading the file; kBadFile if it is no compact network or nothing fits.
  Status InitialiseFrom(const std::filesystem::path& path);

 private:
  struct Round {
    torch::nn::Linear own{nullptr}, other{nullptr}, edge{nullptr}, message{nullptr}, update_first{nullptr},
        update_second{nullptr};
    torch::nn::LayerNorm norm{nullptr};
  };

  CompactConfig config_;
  CopyStart start_;
  torch::nn::Linear embed_first_{nullptr}, embed_second_{nullptr}, head_first_{nullptr}, head_second_{nullptr};
  torch::nn::LayerNorm embed_norm_{nullptr};
  std::vector<Round> rounds_;
  torch::nn::Linear out_strength_{nullptr};
  std::vector<torch::nn::Linear> out_;  // in the order of CopyAttributes
  torch::Tensor low_, high_;
};

}  // namespace anchorsplat
