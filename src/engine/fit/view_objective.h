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

// Where the time of iterations goes, seconds on the clock; averaging of rays counts as rendering and its gradient as
// loss.
struct ObjectiveTimes {
  double render = 0, loss = 0, backward = 0;
};

// What an iteration measures: how far the picture that a cloud gives is from the one it should give, and which way
// every stored value has to move. Keeps its buffers: one object per thread of control.
class ViewObjective {
 public:
  // Renders `cloud` through `camera` and compares with `picture` [3,H,W], which has the camera's size.
  // Errors: those of Rasterizer, PhotometricLoss and PixelModel.
  Result<PhotometricLossValue> Evaluate(const ObjectiveOptions& options, const CloudView& cloud, const Camera& camera,
                                        const Image& picture, CloudGradient& gradient);

  // The two halves of it, for those who look at rendered() before they decide what to compare it with. Compare takes
  // the options and the cloud of the last Show.
  Status Show(const ObjectiveOptions& options, const CloudView& cloud, const Camera& camera);
  // Only to look at.
  Status Show(const ObjectiveOptions& options, ConstantCloud& cloud, const Camera& camera);
  // `step`: that of Rasterizer::Backward.
  Result<PhotometricLossValue> Compare(const ObjectiveOptions& options, const CloudView& cloud, const Image& picture,
                                       CloudGradient& gradient, const CoefficientStep* step = nullptr);

  // What the camera sees of the cloud, of the last Evaluate or Show: [3,H,W].
  const Image& rendered() const { return averaged_ ? average_ : output_.color; }
  const ObjectiveTimes& times() const { return times_; }  // of all calls

 private:
  template <typename Cloud>
  Status ShowCloud(const ObjectiveOptions& options, bool gradient, Cloud& cloud, const Camera& camera);

  Rasterizer rasterizer_;
  RenderOutput output_;  // of rays
  Image average_;        // of them, where a pixel has several
  bool averaged_ = false;
  Image average_gradient_;
  RenderGradient gradient_;
  ObjectiveTimes times_;
};

}  // namespace anchorsplat
