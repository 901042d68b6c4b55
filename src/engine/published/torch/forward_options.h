#pragma once

#include <torch/torch.h>

#include <functional>
#include <string>

namespace anchorsplat {

// Rounding of queries, keys, values and attention output. The published network runs flash attention in fp16 (newer
// PTv3 releases: bf16) and everything else in fp32.
enum class AttentionRounding { kFp32, kFp16, kBf16 };

// Receives intermediate results: "embedding", "enc0.block0.cpe", "enc0.block0.attn", …, "enc0", …, "dec0".
using StageTap = std::function<void(const std::string& stage, const torch::Tensor& value)>;

struct ForwardOptions {
  AttentionRounding rounding = AttentionRounding::kFp32;
  StageTap tap;

  void Tap(const std::string& stage, const torch::Tensor& value) const {
    if (tap) tap(stage, value);
  }
};

}  // namespace anchorsplat
