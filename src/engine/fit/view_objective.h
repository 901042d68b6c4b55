#pragma once

#include "core/camera.h"
#include "core/cloud_view.h"
#include "core/image.h"
#include "core/result.h"
#include "fit/pixel_model.h"
#include "metrics/photometric_loss.h"
#include "render/constant_cloud.h"
#include "render/rasterizer.h"

namespace anchorsplat {

struct ObjectiveOptions {
  RenderOptions render;  // `gradient` is set by the objective
  PhotometricLossOptions loss;
  PixelModel pixel;
};

// Wall-clock seconds of iterations; averaging rays counts as rendering, its gradient as loss.
struct ObjectiveTimes {
  double render = 0, loss = 0, backward = 0;
};

// Loss of a cloud's picture against its target, and the gradient for every stored value. Reuses its buffers: one object
// per thread.
class ViewObjective {
 public:
  // Renders `cloud` through `camera` and compares with `picture` [3,H,W] of the camera's size.
  // Errors: those of Rasterizer, PhotometricLoss and PixelModel.
  Result<PhotometricLossValue> Evaluate(const ObjectiveOptions& options, const CloudView& cloud, const Camera& camera,
                                        const Image& picture, CloudGradient& gradient);

  // Evaluate in two halves, for callers that inspect rendered() before choosing the target. Compare requires the
  // options and cloud of the last Show.
  Status Show(const ObjectiveOptions& options, const CloudView& cloud, const Camera& camera);
  // Without gradient.
  Status Show(const ObjectiveOptions& options, ConstantCloud& cloud, const Camera& camera);
  // `step`: see Rasterizer::Backward.
  Result<PhotometricLossValue> Compare(const ObjectiveOptions& options, const CloudView& cloud, const Image& picture,
                                       CloudGradient& gradient, const CoefficientStep* step = nullptr);

  // Picture of the last Evaluate or Show: [3,H,W].
  const Image& rendered() const { return averaged_ ? average_ : output_.color; }
  const ObjectiveTimes& times() const { return times_; }  // of all calls

 private:
  template <typename Cloud>
  Status ShowCloud(const ObjectiveOptions& options, bool gradient, Cloud& cloud, const Camera& camera);

  Rasterizer rasterizer_;
  RenderOutput output_;  // one pixel per ray
  Image average_;        // averaged rays, if a pixel has several
  bool averaged_ = false;
  Image average_gradient_;
  RenderGradient gradient_;
  ObjectiveTimes times_;
};

}  // namespace anchorsplat
