#pragma once

#include <torch/torch.h>

#include <functional>
#include <string>

namespace anchorsplat {

// To what queries, keys, values and the attention's result are rounded. The published network runs flash attention on
// fp16 (PTv3's newer releases: bf16) and everything else in fp32.
enum class AttentionRounding { kFp32, kFp16, kBf16 };

// Called with intermediate results ("embedding", "enc0.block0.cpe", "enc0.block0.attn", …, "enc0", …, "dec0") where
// somebody wants to see them.
using StageTap = std::function<void(const std::string& stage, const torch::Tensor& value)>;

struct ForwardOptions {
  AttentionRounding rounding = AttentionRounding::kFp32;
  StageTap tap;

  void Tap(const std::string& stage, const torch::Tensor& value) const {
    if (tap) tap(stage, value);
  }
};

}  // namespace anchorsplat
