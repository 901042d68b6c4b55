#pragma once

#include <torch/torch.h>

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "model/compact/compact_config.h"
#include "model/compact/compact_start.h"
#include "model/shared/torch/trainable_network.h"
#include "model/shared/weights.h"

namespace anchorsplat {

// A compact network (model/compact/compact_config.h) with gradients. Neighbours, frames and features are those of
// inference, made once per splat by Prepare; they do not depend on parameters.
class CompactTrainable : public TrainableNetwork {
 public:
  explicit CompactTrainable(const CompactConfig& config);  // must be valid

  // The splat is read on the CPU and its features are put where it lies. Errors (kBadArgument): no Gaussians; values
  // that are not finite (log-scales and opacity logits of −Inf are fine); pixel sizes that are not positive.
  Result<std::shared_ptr<void>> Prepare(const NetworkInput& input) override;

  // Parts know the neighbours that Gaussians have in the whole splat; what is remembered of the range of features is
  // that of the splat as it was surveyed. Errors, besides those of Prepare: offsets in units of the whole splat's cube.
  Result<std::shared_ptr<const void>> Survey(const NetworkInput& whole) override;
  SplatPart PartOf(const std::shared_ptr<const void>& survey, std::span<const int64_t> wanted) override;

  // While training, the range of the features is remembered with every splat (buffers "domain.low" and "domain.high"):
  // of each feature the 0.5 % and 99.5 % quantiles of the splat that went farthest.
  GaussianTensors Forward(const NetworkInput& input) override;

  void ShareMemory(const std::function<void(torch::Tensor&)>& maximum) override;

  int copies() const override { return static_cast<int>(config_.copies); }
  std::vector<std::pair<std::string, std::vector<torch::Tensor>>> Groups() override;
  Status Save(const std::filesystem::path& path, const std::map<std::string, std::string>& metadata) override;

  const CompactConfig& config() const { return config_; }

  // Raw outputs [N, CompactOutputs(config())], or of a part's wanted Gaussians, in the order of
  // CompactNetwork::Outputs.
  torch::Tensor Outputs(const NetworkInput& input);

  // Fills parameters and buffers. Errors are those of `source`.
  Status SetWeights(const WeightSource& source);
  // Parameters and buffers as they are now or later, for CompactNetwork::Load. Shares them.
  WeightSource Weights();

  // Begins with another network's weights and with the range of its training data: tensors of the same name and shape,
  // output layers of another number of copies, all of which then begin as its first, and layers that were told less,
  // to which what is new says nothing yet. Errors: of reading the file;
  // kBadFile when it is no compact network or nothing of it fits.
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
  std::vector<torch::nn::Linear> out_;  // as CopyAttributes
  torch::Tensor low_, high_;
};

}  // namespace anchorsplat
