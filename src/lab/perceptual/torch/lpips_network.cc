#include "perceptual/torch/lpips_network.h"

#include <algorithm>
#include <string>

#include "core/text.h"

namespace anchorsplat {

namespace {

using Kind = LpipsStep::Kind;

constexpr double kEpsilon = 1e-10;

size_t TensorsOf(const LpipsStep& step) {
  return step.kind == Kind::kMaxPool ? 0 : step.kind == Kind::kConvolution ? 2 : 6;
}

// Normalisation with gradient 0 at 0, where that of a square root would be infinite.
at::Tensor UnitLength(const at::Tensor& x) {
  return x / (at::linalg_vector_norm(x, 2, {1}, /*keepdim=*/true) + kEpsilon);
}

}  // namespace

Result<LpipsNetwork> LpipsNetwork::Make(LpipsNet net, std::span<const std::span<const float>> tensors) {
  const std::vector<LpipsTensorSpec> specs = LpipsTensors(net);
  if (tensors.size() != specs.size()) {
    return Error{ErrorCode::kBadArgument,
                 Cat(tensors.size(), " tensors for LPIPS ", LpipsNetName(net), ", which has ", specs.size())};
  }
  LpipsNetwork network(net);
  for (size_t i = 0; i < specs.size(); ++i) {
    int64_t elements = 1;
    for (const int64_t side : specs[i].shape) elements *= side;
    if (static_cast<int64_t>(tensors[i].size()) != elements) {
      return Error{ErrorCode::kBadArgument, Cat("tensor ", specs[i].name, " of LPIPS ", LpipsNetName(net), " has ",
                                                tensors[i].size(), " values instead of ", elements)};
    }
    network.tensors_.push_back(
        at::from_blob(const_cast<float*>(tensors[i].data()), specs[i].shape, at::kFloat).clone());
  }
  for (const LpipsStep& step : LpipsSteps(net)) network.heads_ += TensorsOf(step);
  return network;
}

void LpipsNetwork::To(const at::TensorOptions& options) {
  for (at::Tensor& tensor : tensors_) tensor = tensor.to(options);
}

// Scales to [−1, 1], then normalises by ImageNet's mean and deviation on that scale, as published.
at::Tensor LpipsNetwork::Prepare(const at::Tensor& x) const {
  const auto channel = [&](double r, double g, double b) {
    return at::tensor({r, g, b}, at::kDouble).to(tensors_[0].options()).view({1, 3, 1, 1});
  };
  return (2 * x - 1 - channel(-0.030, -0.088, -0.188)) / channel(0.458, 0.448, 0.450);
}

at::Tensor LpipsNetwork::Run(const LpipsStep& step, size_t first, const at::Tensor& x) const {
  const auto convolution = [&](const at::Tensor& input, size_t k, int stride, int padding) {
    return at::relu(at::conv2d(input, tensors_[first + k], tensors_[first + k + 1], stride, padding));
  };
  switch (step.kind) {
    case Kind::kMaxPool:
      return at::max_pool2d(x, step.kernel, step.stride, 0, 1, step.ceil);
    case Kind::kConvolution:
      return convolution(x, 0, step.stride, step.padding);
    case Kind::kFire:
      break;
  }
  const at::Tensor squeezed = convolution(x, 0, 1, 0);
  return at::cat({convolution(squeezed, 2, 1, 0), convolution(squeezed, 4, 1, 1)}, 1);
}

at::Tensor LpipsNetwork::Weighted(size_t layer, const at::Tensor& a, const at::Tensor& b) const {
  return at::conv2d((a - b).square(), tensors_[heads_ + layer]).mean({1, 2, 3});
}

at::Tensor LpipsNetwork::Distance(const at::Tensor& a, const at::Tensor& b) const {
  at::Tensor x = Prepare(a), y = Prepare(b);
  at::Tensor sum;
  size_t at = 0, layer = 0;
  for (const LpipsStep& step : LpipsSteps(net_)) {
    x = Run(step, at, x);
    y = Run(step, at, y);
    at += TensorsOf(step);
    if (!step.compared) continue;
    const at::Tensor distance = Weighted(layer++, UnitLength(x), UnitLength(y));
    sum = sum.defined() ? sum + distance : distance;
  }
  return sum;
}

std::vector<at::Tensor> LpipsNetwork::Features(const at::Tensor& picture) const {
  std::vector<at::Tensor> layers;
  at::Tensor x = Prepare(picture);
  size_t at = 0;
  for (const LpipsStep& step : LpipsSteps(net_)) {
    x = Run(step, at, x);
    at += TensorsOf(step);
    if (step.compared) layers.push_back(UnitLength(x));
  }
  return layers;
}

at::Tensor LpipsNetwork::Distance(const std::vector<at::Tensor>& a, const std::vector<at::Tensor>& b) const {
  at::Tensor sum = Weighted(0, a[0], b[0]);
  for (size_t layer = 1; layer < a.size(); ++layer) sum = sum + Weighted(layer, a[layer], b[layer]);
  return sum;
}

}  // namespace anchorsplat
