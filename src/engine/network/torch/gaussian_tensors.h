#pragma once

#include <torch/torch.h>

#include "core/gaussian_cloud.h"

namespace anchorsplat {

// A splat as tensors in stored space (log-scales, opacity logits, raw quaternions wxyz, SH coefficient-major), float32,
// world units.
struct GaussianTensors {
  torch::Tensor means;           // [N,3]
  torch::Tensor log_scales;      // [N,3]
  torch::Tensor quats;           // [N,4]
  torch::Tensor opacity_logits;  // [N]
  torch::Tensor sh;              // [N,C,3], C = 1, 4, 9 or 16

  int64_t size() const { return opacity_logits.size(0); }
  GaussianTensors To(torch::Device device) const;
};

// Copies values unchanged; drops metadata. `gaussians` must have the shapes above.
GaussianTensors ToTensors(const GaussianCloud& cloud);
GaussianCloud ToCloud(const GaussianTensors& gaussians);

}  // namespace anchorsplat
