#include "published/torch/serialized_attention.h"

#include <algorithm>

namespace anchorsplat {

namespace {

torch::Tensor Round(const torch::Tensor& x, AttentionRounding rounding) {
  switch (rounding) {
    case AttentionRounding::kFp16:
      return x.to(torch::kFloat16).to(x.scalar_type());
    case AttentionRounding::kBf16:
      return x.to(torch::kBFloat16).to(x.scalar_type());
    case AttentionRounding::kFp32:
      break;
  }
  return x;
}

}  // namespace

SerializedAttentionImpl::SerializedAttentionImpl(int64_t channels, int64_t heads) : heads_(heads) {
  qkv = register_module("qkv", torch::nn::Linear(channels, 3 * channels));
  proj = register_module("proj", torch::nn::Linear(channels, channels));
}

torch::Tensor SerializedAttentionImpl::forward(const torch::Tensor& x, const LevelTensors& level, int slot,
                                               AttentionRounding rounding) {
  const int64_t channels = x.size(1), head = channels / heads_;
  const torch::Tensor& rows = level.patch_rows[static_cast<size_t>(slot)];
  const int64_t patch = std::min(level.patch_size, std::max<int64_t>(1, rows.size(0)));
  const int64_t patches = rows.size(0) / patch;
  const torch::Tensor sequence = Round(qkv(x), rounding).index_select(0, rows).view({patches, patch, 3, heads_, head});
  const auto parts = sequence.permute({2, 0, 3, 1, 4}).unbind(0);  // each [patches, heads, patch, head]
  torch::Tensor y = torch::scaled_dot_product_attention(parts[0], parts[1], parts[2]);
  y = Round(y, rounding).transpose(1, 2).reshape({patches * patch, channels});
  // Back to point order; results of borrowed slots are dropped.
  return proj(y.index_select(0, level.positions[static_cast<size_t>(slot)]));
}

}  // namespace anchorsplat
