#pragma once

#include <torch/torch.h>

#include <memory>
#include <span>
#include <vector>

#include "core/camera.h"
#include "core/result.h"
#include "network/torch/gaussian_tensors.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// A rendered view in the layout of Image: planes of rows.
struct RenderedView {
  torch::Tensor color;  // [3,H,W] float32 on the CPU, background included, not clamped above 1
  torch::Tensor alpha;  // [1,H,W] 1 − transmittance
};

// The rasterizer of render/ as an autograd operation. Pictures are differentiable in all values of a splat by the
// rasterizer's own backward pass, whose header says where it is exact. Views render in parallel, one thread each once
// there are as many views as threads; results are bit-identical to rendering them in sequence.
//
// To render part of a picture, pass a cropped camera (Crop in core/camera.h).
//
// Buffers are reused until the object and every graph it made are gone.
class RenderOp {
 public:
  RenderOp();

  // Renders each camera's view. Ignores options.depth and sets options.gradient itself. Tensors on other devices are
  // copied to the CPU. Only tensors that require gradients receive them; outputs unused by the loss cost nothing.
  // Errors: those of Rasterizer::Render. A failed backward pass (memory) throws, as autograd expects.
  Result<std::vector<RenderedView>> operator()(const GaussianTensors& gaussians, std::span<const Camera> cameras,
                                               const RenderOptions& options);

  // Wall-clock seconds spent in backward passes since the last reset.
  double backward_seconds() const;
  void ResetBackwardSeconds();

  struct Pool;

 private:
  std::shared_ptr<Pool> pool_;
};

}  // namespace anchorsplat
