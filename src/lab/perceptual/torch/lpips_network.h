#pragma once

#include <ATen/ATen.h>

#include <span>
#include <vector>

#include "core/result.h"
#include "perceptual/lpips_net.h"

namespace anchorsplat {

// LPIPS on tensors, differentiable in the pictures; the weights are constants. With eps = 1e-10 as published:
//     d(a, b) = Σ_k mean_{h,w} Σ_c w_kc·(â_kc − b̂_kc)²,   x̂ = x / (‖x‖₂ + eps) over the channels of layer k.
class LpipsNetwork {
 public:
  // `tensors`: the values of LpipsTensors(net), copied. kBadArgument when their number or a size is another.
  static Result<LpipsNetwork> Make(LpipsNet net, std::span<const std::span<const float>> tensors);

  // Weights to another device or to double.
  void To(const at::TensorOptions& options);

  // a, b: [B,3,H,W], 0–1, on the weights' device and of their type; H and W at least SmallestLpipsSide(net). → [B].
  // Layers are compared as they come, so that without gradients only one pair of them is in memory.
  at::Tensor Distance(const at::Tensor& a, const at::Tensor& b) const;

  // For a picture that others are compared with again and again: the layers compared, of unit length over the channels.
  std::vector<at::Tensor> Features(const at::Tensor& x) const;
  at::Tensor Distance(const std::vector<at::Tensor>& a, const std::vector<at::Tensor>& b) const;

 private:
  explicit LpipsNetwork(LpipsNet net) : net_(net) {}
  at::Tensor Prepare(const at::Tensor& x) const;
  at::Tensor Run(const LpipsStep& step, size_t first_tensor, const at::Tensor& x) const;
  at::Tensor Weighted(size_t layer, const at::Tensor& a, const at::Tensor& b) const;

  LpipsNet net_;
  std::vector<at::Tensor> tensors_;  // of the steps, then of the heads
  size_t heads_ = 0;                 // index of the first head
};

}  // namespace anchorsplat
