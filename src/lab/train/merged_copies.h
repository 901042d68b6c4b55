#pragma once

#include <torch/torch.h>

#include <cstdint>

#include "core/render_mode.h"
#include "model/shared/torch/gaussian_tensors.h"

namespace anchorsplat {

// Which copies are merged, as CopyChoice and CopyGroups have it.
struct MergeRule {
  int64_t copies = 1;         // K, of N Gaussians each, row k·N + i
  torch::Tensor pixel_sizes;  // [N] of the closer view, world units
  RenderMode mode = RenderMode::kClassic;
  double cost = 0;  // what a merge may cost
};

// What `enhance` leaves of a network's copies (model/compact/copy_choice.h), on the CPU: those that stay alone, then
// those that others have been merged into. A network that learns through this says copies that merge well.
//
// The values are those of the merge itself. Its gradient is that of the copies' mass, mean and covariance, to first
// order: of eigenvalues and eigenvectors as those of a matrix that changes a little, without the masses that copies
// share and what the limit of 1/255 takes of them. Who merges with whom counts as given.
GaussianTensors MergedCopies(const GaussianTensors& all, const MergeRule& rule);

}  // namespace anchorsplat
