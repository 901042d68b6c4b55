#pragma once

#include <torch/torch.h>

#include <cstdint>

#include "core/render_mode.h"
#include "network/torch/gaussian_tensors.h"

namespace anchorsplat {

// Which copies to merge, as in CopyChoice and CopyGroups.
struct MergeRule {
  int64_t copies = 1;         // K, of N Gaussians each, row k·N + i
  torch::Tensor pixel_sizes;  // [N] of the closer view, world units
  RenderMode mode = RenderMode::kClassic;
  double cost = 0;  // maximum cost of a merge
};

// Merges a network's copies on the CPU as `enhance` does (compact/copy_choice.h): returns the unmerged ones, then
// the merged ones. Training through this makes networks produce copies that merge well.
//
// Values are exactly those of the merge. The gradient is that of the copies' mass, mean and covariance to first order
// (eigenvalues and eigenvectors by perturbation theory), ignoring shared mass and the 1/255 limit. Which copies merge
// is taken as constant.
GaussianTensors MergedCopies(const GaussianTensors& all, const MergeRule& rule);

}  // namespace anchorsplat
