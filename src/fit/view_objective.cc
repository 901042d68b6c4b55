#include "fit/view_objective.h"

#include "fit/stopwatch.h"

namespace anchorsplat {

Result<PhotometricLossValue> ViewObjective::Evaluate(const ObjectiveOptions& options, const GaussianCloud& cloud,
                                                     const Camera& camera, const Image& picture,
                                                     CloudGradient& gradient) {
  Stopwatch watch;
  RenderOptions render = options.render;
  render.gradient = true;
  ANCHORSPLAT_RETURN_IF_ERROR(rasterizer_.Render(cloud, camera, render, output_));
  times_.render += watch.Lap();
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PhotometricLossValue value,
                               PhotometricLoss(output_.color, picture, options.loss, gradient_.color, gradient_.box));
  times_.loss += watch.Lap();
  ANCHORSPLAT_RETURN_IF_ERROR(rasterizer_.Backward(cloud, gradient_, gradient));
  times_.backward += watch.Lap();
  return value;
}

}  // namespace anchorsplat
