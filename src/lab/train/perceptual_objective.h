#pragma once

#include <torch/torch.h>

#include <span>

#include "core/result.h"
#include "perceptual/lpips_weights.h"
#include "perceptual/torch/lpips_network.h"
#include "train/photometric_objective.h"

namespace anchorsplat {

// LPIPS as a loss term: mean distance over the views' `perceptual` regions.
class PerceptualObjective {
 public:
  // Errors: those of ReadLpipsWeights for LpipsFolder(); kNotFound says what to run.
  static Result<PerceptualObjective> Open(LpipsNet net);
  static Result<PerceptualObjective> Make(const LpipsWeights& weights);

  // Differentiable in `rendered`; 0 if no view has a region. Clamps values above 1.
  torch::Tensor operator()(std::span<const torch::Tensor> rendered, std::span<const TrueView> truth) const;

  // Distance of two whole pictures [3,H,W] with values 0–1, without gradient.
  double Distance(const Image& a, const Image& b) const;

 private:
  explicit PerceptualObjective(LpipsNetwork network) : network_(std::move(network)) {}

  LpipsNetwork network_;
};

}  // namespace anchorsplat
