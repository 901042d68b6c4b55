#include "published/torch/block.h"

#include "kernels/layer_norm.h"
#include "published/published_config.h"

namespace anchorsplat {

namespace {
torch::nn::LayerNorm LayerNormOf(int64_t channels) {
  return torch::nn::LayerNorm(torch::nn::LayerNormOptions({channels}).eps(kLayerNormEpsilon));
}
}  // namespace

torch::Tensor DropPath(const torch::Tensor& x, double rate, bool training) {
  if (!training || rate <= 0) return x;
  const double keep = 1 - rate;
  return x * (torch::empty({x.size(0), 1}, x.options()).bernoulli_(keep) / keep);
}

MlpImpl::MlpImpl(int64_t channels, int64_t hidden) {
  fc1 = register_module("fc1", torch::nn::Linear(channels, hidden));
  fc2 = register_module("fc2", torch::nn::Linear(hidden, channels));
}

BlockImpl::BlockImpl(int64_t channels, int64_t heads, double drop_path)
    : conv(channels, channels),
      cpe_linear(channels, channels),
      cpe_norm(LayerNormOf(channels)),
      norm1(LayerNormOf(channels)),
      attention(channels, heads),
      norm2(LayerNormOf(channels)),
      mlp(channels, 4 * channels),
      drop_path_(drop_path) {
  // These lists only name the parameters as in published checkpoints: cpe.0, norm1.0, …
  register_module("cpe", torch::nn::ModuleList(conv, cpe_linear, cpe_norm));
  register_module("norm1", torch::nn::ModuleList(norm1));
  register_module("attn", attention);
  register_module("norm2", torch::nn::ModuleList(norm2));
  register_module("mlp", torch::nn::ModuleList(mlp));
}

torch::Tensor BlockImpl::forward(torch::Tensor x, const torch::Tensor& conv_in, const LevelTensors& level, int slot,
                                 const ForwardOptions& options, const std::string& name) {
  const torch::Tensor encoding = cpe_norm(cpe_linear(conv(conv_in, level)));
  options.Tap(name + ".cpe", encoding);
  x = x + encoding;
  const torch::Tensor attended = attention(norm1(x), level, slot, options.rounding);
  options.Tap(name + ".attn", attended);
  x = x + DropPath(attended, drop_path_, is_training());
  return x + DropPath(mlp(norm2(x)), drop_path_, is_training());
}

}  // namespace anchorsplat
