#include "published/torch/published_trainable.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

#include "core/fingerprint.h"
#include "network/torch/trainable_network.h"
#include "published/feature_rows.h"
#include "published/published_checkpoint.h"
#include "published/torch/published_module.h"
#include "tensors/safetensors.h"

namespace anchorsplat {

namespace {

constexpr int64_t kCoefficients = 16;  // the published network's rows have SH degree 3

struct Prepared {
  Normalisation normalisation;
  torch::Tensor features;  // [N,59] of the normalised splat
  Hierarchy hierarchy;
};

// The published network (Point Transformer V3 with six heads) as a TrainableNetwork.
class AnchorSplatTrainable : public TrainableNetwork {
 public:
  AnchorSplatTrainable(const PublishedConfig& config, bool shuffle, AttentionRounding rounding)
      : network_(config), shuffle_(shuffle), rounding_(rounding) {
    register_module("network", network_);
  }

  Result<std::shared_ptr<void>> Prepare(const NetworkInput& input) override;
  GaussianTensors Forward(const NetworkInput& input) override;
  int copies() const override { return static_cast<int>(network_->config.copies); }
  std::vector<std::pair<std::string, std::vector<torch::Tensor>>> Groups() override;
  Status Save(const std::filesystem::path& path, const std::map<std::string, std::string>& metadata) override;

 private:
  AnchorSplatNetwork network_;
  bool shuffle_;
  AttentionRounding rounding_;
};

Result<std::shared_ptr<void>> AnchorSplatTrainable::Prepare(const NetworkInput& input) {
  const torch::NoGradGuard no_gradient;
  const GaussianTensors& g = input.gaussians;
  const torch::Tensor means = g.means.to(torch::kCPU).contiguous();
  const int64_t n = means.size(0);
  const std::span<const float> values(means.const_data_ptr<float>(), static_cast<size_t>(3 * n));
  const auto prepared = std::make_shared<Prepared>();
  ANCHORSPLAT_ASSIGN_OR_RETURN(prepared->normalisation, FitNormalisation(values, NormalisationMode::kAuto));
  const Normalisation& to_cube = prepared->normalisation;
  const torch::Tensor shift = torch::tensor({to_cube.shift[0], to_cube.shift[1], to_cube.shift[2]});
  torch::Tensor sh = g.sh.to(torch::kCPU);
  if (sh.size(1) < kCoefficients) sh = torch::cat({sh, torch::zeros({n, kCoefficients - sh.size(1), 3})}, 1);
  // Rounding pushes extreme Gaussians of some clouds just outside the cube.
  const torch::Tensor in_cube = (means * to_cube.scale + shift).clamp(0, 1);
  const torch::Tensor features =
      torch::cat({in_cube, g.log_scales.to(torch::kCPU) + to_cube.LogScale(),
                  g.opacity_logits.to(torch::kCPU).unsqueeze(1), g.quats.to(torch::kCPU), sh.flatten(1)},
                 1);
  // Seeded by the splat's values alone, so that a resumed training draws the same orders.
  Fingerprint print;
  print.AddWords(values);
  const Shuffles shuffles = shuffle_ ? ShufflesFromSeed(print.value()) : kNoShuffles;
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<Level> levels,
                               BuildHierarchy(GridVoxels(features.const_data_ptr<float>(), n, kFeatures),
                                              HierarchyOptionsFor(network_->config, shuffles)));
  prepared->hierarchy = ToTensors(std::move(levels), network_->config.patch_size, g.means.device());
  prepared->features = features.to(g.means.device());
  return std::static_pointer_cast<void>(prepared);
}

GaussianTensors AnchorSplatTrainable::Forward(const NetworkInput& input) {
  const Prepared& prepared = *std::static_pointer_cast<Prepared>(input.prepared);
  const Normalisation& to_cube = prepared.normalisation;
  ForwardOptions options;
  options.rounding = rounding_;
  const torch::Tensor rows =
      network_(prepared.features, prepared.hierarchy, options).flatten(0, 1).to(torch::kFloat32);  // [K·N,59]
  const torch::Tensor shift = torch::tensor({to_cube.shift[0], to_cube.shift[1], to_cube.shift[2]}).to(rows.device());
  return {(rows.narrow(1, 0, 3) - shift) / to_cube.scale, rows.narrow(1, 3, 3) - to_cube.LogScale(),
          rows.narrow(1, 7, 4), rows.select(1, 6), rows.narrow(1, 11, 48).view({-1, kCoefficients, 3})};
}

std::vector<std::pair<std::string, std::vector<torch::Tensor>>> AnchorSplatTrainable::Groups() {
  std::vector<std::pair<std::string, std::vector<torch::Tensor>>> groups = {{"backbone", {}}};
  groups[0].second = network_->backbone->parameters();
  for (size_t a = 0; a < network_->heads->layers.size(); ++a) {
    std::vector<torch::Tensor> parameters;
    for (const torch::nn::Linear& layer : network_->heads->layers[a]) {
      parameters.push_back(layer->weight);
      parameters.push_back(layer->bias);
    }
    groups.emplace_back(kAttributes[a].name, std::move(parameters));
  }
  groups.emplace_back("point_embeddings", std::vector<torch::Tensor>(network_->heads->embeddings.begin(),
                                                                     network_->heads->embeddings.end()));
  return groups;
}

Status AnchorSplatTrainable::Save(const std::filesystem::path& path,
                                  const std::map<std::string, std::string>& metadata) {
  std::map<std::string, std::string> all = metadata;
  for (const auto& [key, value] : ArchitectureMetadata(network_->config)) all[key] = value;
  std::vector<torch::Tensor> kept;  // host copies, kept until written
  std::vector<TensorEntry> entries;
  for (const auto& [name, tensor] : network_->StateDict()) {
    const bool counter = tensor.scalar_type() == torch::kInt64;
    kept.push_back(tensor.detach().to(torch::kCPU, counter ? torch::kInt64 : torch::kFloat32).contiguous());
    const auto size = static_cast<size_t>(tensor.numel());
    const std::vector<int64_t> shape = tensor.sizes().vec();
    entries.push_back(counter ? MakeEntry(name, shape, std::span(kept.back().const_data_ptr<int64_t>(), size))
                              : MakeEntry(name, shape, std::span(kept.back().const_data_ptr<float>(), size)));
  }
  return WriteSafetensors(path, entries, all, {.overwrite = true});
}

}  // namespace

Result<std::shared_ptr<TrainableNetwork>> MakePublishedTrainable(const NetworkOptions& options) {
  PublishedConfig config;
  bool shuffle = true;
  std::string attention = "fp32";
  OptionReader reader(options);
  reader.Integer("copies", 1, 256, config.copies);
  reader.Integers("encoder_channels", 1, 4096, config.encoder_channels);
  reader.Integers("encoder_blocks", 1, 64, config.encoder_blocks);
  reader.Integers("decoder_channels", 1, 4096, config.decoder_channels);
  reader.Integers("decoder_blocks", 1, 64, config.decoder_blocks);
  reader.Integer("head_hidden", 1, 4096, config.head_hidden);
  reader.Number("drop_path", 0, 0.99, config.drop_path);
  reader.Flag("shuffle_orders", shuffle);
  reader.Text("attention", {"fp32", "fp16", "bf16"}, attention);
  ANCHORSPLAT_RETURN_IF_ERROR(reader.Finish());
  // Heads, strides and patch size stay as published: no tensor encodes them, so readers could not know others.
  const size_t stages = config.encoder_channels.size();
  if (stages >= 1 && stages <= config.encoder_heads.size()) {
    config.encoder_heads.resize(stages);
    config.decoder_heads.resize(stages - 1);
    config.strides.resize(stages - 1);
  }
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(config));
  const AttentionRounding rounding = attention == "fp16"   ? AttentionRounding::kFp16
                                     : attention == "bf16" ? AttentionRounding::kBf16
                                                           : AttentionRounding::kFp32;
  return std::static_pointer_cast<TrainableNetwork>(std::make_shared<AnchorSplatTrainable>(config, shuffle, rounding));
}

}  // namespace anchorsplat
