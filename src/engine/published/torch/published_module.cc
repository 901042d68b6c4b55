#include "published/torch/published_module.h"

#include <algorithm>
#include <map>

#include "core/text.h"

namespace anchorsplat {

namespace {

// An empty module that only names its submodules and parameters.
class HeadGroupImpl : public torch::nn::Module {};
TORCH_MODULE(HeadGroup);

void AppendState(const torch::nn::Module& module, const std::string& prefix,
                 std::vector<std::pair<std::string, torch::Tensor>>& state) {
  for (const auto& item : module.named_parameters(/*recurse=*/false))
    state.emplace_back(prefix + item.key(), item.value());
  for (const auto& item : module.named_buffers(/*recurse=*/false))
    state.emplace_back(prefix + item.key(), item.value());
  for (const auto& child : module.named_children()) AppendState(*child.value(), prefix + child.key() + ".", state);
}

}  // namespace

GaussianHeadsImpl::GaussianHeadsImpl(int64_t channels, int64_t hidden, int64_t copies) : copies_(copies) {
  torch::NoGradGuard no_grad;
  for (size_t a = 0; a < layers.size(); ++a) {
    const int64_t out = copies * kAttributes[a].channels;
    layers[a] = {torch::nn::Linear(channels + kFeatures, hidden), torch::nn::Linear(hidden, hidden),
                 torch::nn::Linear(hidden, hidden), torch::nn::Linear(hidden, out)};
    // Training starts from the anchors, distinguished by the embeddings alone.
    layers[a][3]->weight.zero_();
    layers[a][3]->bias.zero_();
    embeddings[a] = torch::randn({copies, kAttributes[a].channels}).mul_(0.01);
  }
}

void GaussianHeadsImpl::RegisterIn(torch::nn::Module& network) {
  HeadGroup mlps, points;
  for (size_t a = 0; a < layers.size(); ++a) {
    const std::string name = kAttributes[a].name;
    HeadGroup mlp;
    // Even indices: the odd ones are ReLUs.
    for (size_t i = 0; i < layers[a].size(); ++i) mlp->register_module(Cat(2 * i), layers[a][i]);
    mlps->register_module(name, mlp);
    embeddings[a] = points->register_parameter(name, embeddings[a]);
  }
  network.register_module("features_outputhead", mlps);
  network.register_module("point_embeddings", points);
}

torch::Tensor GaussianHeadsImpl::forward(const torch::Tensor& context, const torch::Tensor& features) {
  const int64_t n = features.size(0);
  const torch::Tensor input = torch::cat({context, features}, 1);
  std::vector<torch::Tensor> columns;
  for (size_t a = 0; a < layers.size(); ++a) {
    torch::Tensor y = input;
    for (size_t i = 0; i + 1 < layers[a].size(); ++i) y = torch::relu(layers[a][i](y));
    y = layers[a].back()(y).view({n, copies_, kAttributes[a].channels}).transpose(0, 1) + embeddings[a].unsqueeze(1);
    if (a == 0) y = kAnchorOffsetScale * torch::tanh(y);
    columns.push_back(y);
  }
  return features.unsqueeze(0) + torch::cat(columns, 2);
}

AnchorSplatNetworkImpl::AnchorSplatNetworkImpl(const PublishedConfig& network_config)
    : config(network_config),
      backbone(network_config),
      heads(network_config.context_channels(), network_config.head_hidden, network_config.copies) {
  register_module("backbone", HeadGroup())->register_module("backbone", backbone);
  heads->RegisterIn(*this);
}

torch::Tensor AnchorSplatNetworkImpl::forward(const torch::Tensor& features, const Hierarchy& hierarchy,
                                              const ForwardOptions& options) {
  return heads(backbone(features, hierarchy, options), features);
}

std::vector<std::pair<std::string, torch::Tensor>> AnchorSplatNetworkImpl::StateDict() {
  std::vector<std::pair<std::string, torch::Tensor>> state;
  AppendState(*this, "", state);
  return state;
}

Status SetWeights(AnchorSplatNetworkImpl& network, const WeightSource& source) {
  torch::NoGradGuard no_grad;
  for (auto& [name, tensor] : network.StateDict()) {
    const TensorSpec spec{name, tensor.sizes().vec(), tensor.scalar_type() == torch::kInt64};
    if (spec.counter) {
      tensor.zero_();
      continue;
    }
    const torch::Tensor values = torch::empty(tensor.sizes(), torch::kFloat32);
    ANCHORSPLAT_RETURN_IF_ERROR(source(spec, {values.data_ptr<float>(), static_cast<size_t>(values.numel())}));
    tensor.copy_(values);
  }
  return {};
}

WeightSource WeightsOf(AnchorSplatNetworkImpl& network) {
  std::map<std::string, torch::Tensor> state;
  for (auto& [name, tensor] : network.StateDict()) state.emplace(name, tensor);
  return [state = std::move(state)](const TensorSpec& tensor, std::span<float> values) -> Status {
    const torch::Tensor own = state.at(tensor.name).detach().to(torch::kCPU, torch::kFloat32).contiguous();
    std::copy_n(own.data_ptr<float>(), values.size(), values.begin());
    return {};
  };
}

}  // namespace anchorsplat
