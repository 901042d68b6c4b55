#pragma once

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/image.h"
#include "core/result.h"
#include "metrics/photometric_loss.h"
#include "render/rasterizer.h"

namespace anchorsplat {

struct ObjectiveOptions {
  RenderOptions render;  // `gradient` is set by the objective
  PhotometricLossOptions loss;
};

// Where the time of iterations goes, seconds on the clock.
struct ObjectiveTimes {
  double render = 0, loss = 0, backward = 0;
};

// What an iteration measures: how far the picture that a cloud gives is from the one it should give, and which way
// every stored value has to move. Keeps its buffers: one object per thread of control.
class ViewObjective {
 public:
  // Renders `cloud` through `camera` and compares with `picture` [3,H,W], which has the camera's size.
  // Errors: those of Rasterizer and PhotometricLoss.
  Result<PhotometricLossValue> Evaluate(const ObjectiveOptions& options, const GaussianCloud& cloud,
                                        const Camera& camera, const Image& picture, CloudGradient& gradient);

  const Image& rendered() const { return output_.color; }  // of the last Evaluate
  const ObjectiveTimes& times() const { return times_; }   // of all calls

 private:
  Rasterizer rasterizer_;
  RenderOutput output_;
  RenderGradient gradient_;
  ObjectiveTimes times_;
};

}  // namespace anchorsplat
