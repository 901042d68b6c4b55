#pragma once

#include <ATen/ATen.h>

#include <span>
#include <vector>

#include "core/result.h"
#include "perceptual/lpips_net.h"

namespace anchorsplat {

// LPIPS on tensors, differentiable in the pictures, with constant weights. With eps = 1e-10 as published:
//     d(a, b) = Σ_k mean_{h,w} Σ_c w_kc·(â_kc − b̂_kc)²,   x̂ = x / (‖x‖₂ + eps) over the channels of layer k.
class LpipsNetwork {
 public:
  // `tensors`: values of LpipsTensors(net); copied. kBadArgument: wrong number or size.
  static Result<LpipsNetwork> Make(LpipsNet net, std::span<const std::span<const float>> tensors);

  // Moves the weights to another device or type.
  void To(const at::TensorOptions& options);

  // a, b: [B,3,H,W], 0–1, of the weights' device and type; H and W at least SmallestLpipsSide(net). → [B]. Compares
  // layers as they are computed, so without gradients only one pair is in memory.
  at::Tensor Distance(const at::Tensor& a, const at::Tensor& b) const;

  // Compared layers of a picture, normalised over channels; to compare it with several others.
  std::vector<at::Tensor> Features(const at::Tensor& x) const;
  at::Tensor Distance(const std::vector<at::Tensor>& a, const std::vector<at::Tensor>& b) const;

 private:
  explicit LpipsNetwork(LpipsNet net) : net_(net) {}
  at::Tensor Prepare(const at::Tensor& x) const;
  at::Tensor Run(const LpipsStep& step, size_t first_tensor, const at::Tensor& x) const;
  at::Tensor Weighted(size_t layer, const at::Tensor& a, const at::Tensor& b) const;

  LpipsNet net_;
  std::vector<at::Tensor> tensors_;  // of the steps, then the heads
  size_t heads_ = 0;                 // index of the first head
};

}  // namespace anchorsplat
