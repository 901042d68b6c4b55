#pragma once

#include <torch/torch.h>

#include <span>

#include "core/result.h"
#include "perceptual/lpips_weights.h"
#include "perceptual/torch/lpips_network.h"
#include "train/photometric_objective.h"

namespace anchorsplat {

// LPIPS as a term of the loss: the mean distance of the parts of the views that `perceptual` of each truth names.
class PerceptualObjective {
 public:
  // Errors: those of ReadLpipsWeights, looked for in LpipsFolder(): kNotFound says what to run.
  static Result<PerceptualObjective> Open(LpipsNet net);
  static Result<PerceptualObjective> Make(const LpipsWeights& weights);

  // Differentiable in `rendered`; 0 when no view has a part to look at. Values above 1 count as 1.
  torch::Tensor operator()(std::span<const torch::Tensor> rendered, std::span<const TrueView> truth) const;

  // Of two whole pictures [3,H,W] with values 0–1, without gradient.
  double Distance(const Image& a, const Image& b) const;

 private:
  explicit PerceptualObjective(LpipsNetwork network) : network_(std::move(network)) {}

  LpipsNetwork network_;
};

}  // namespace anchorsplat
