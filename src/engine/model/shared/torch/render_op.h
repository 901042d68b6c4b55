#pragma once

#include <torch/torch.h>

#include <memory>
#include <span>
#include <vector>

#include "core/camera.h"
#include "core/result.h"
#include "model/shared/torch/gaussian_tensors.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// What a camera sees, in the layout of Image: planes of rows.
struct RenderedView {
  torch::Tensor color;  // [3,H,W] float32 on the CPU, background included, not clamped above 1
  torch::Tensor alpha;  // [1,H,W] 1 − transmittance
};

// The rasterizer of render/ as an operation of autograd: pictures of a splat, differentiable in all of its values by
// the rasterizer's own backward pass (which says where it is exact). Views are rendered side by side, one thread each
// where there are as many views as threads; pictures and gradients are the same bits as those made one after the other.
//
// A part of a picture is rendered by a camera with a smaller size and a shifted principal point: see Crop in
// core/camera.h.
//
// Buffers are kept for the next call until the object and all graphs made by it are gone.
class RenderOp {
 public:
  RenderOp();

  // `options.gradient` is set by the operation, `options.depth` is ignored. Tensors on another device are copied to the
  // CPU. Gradients flow to the tensors that ask for them; colours and alphas that no loss used cost nothing.
  // Errors: those of Rasterizer::Render. A failure in the backward pass (memory) is thrown, as autograd has it.
  Result<std::vector<RenderedView>> operator()(const GaussianTensors& gaussians, std::span<const Camera> cameras,
                                               const RenderOptions& options);

  // Seconds on the clock that backward passes have taken since they were last set to 0.
  double backward_seconds() const;
  void ResetBackwardSeconds();

  struct Pool;

 private:
  std::shared_ptr<Pool> pool_;
};

}  // namespace anchorsplat
