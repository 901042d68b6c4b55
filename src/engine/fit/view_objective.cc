#include "fit/view_objective.h"

#include "core/stopwatch.h"

namespace anchorsplat {

template <typename Cloud>
Status ViewObjective::ShowCloud(const ObjectiveOptions& options, bool gradient, Cloud& cloud, const Camera& camera) {
  Stopwatch watch;
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(options.pixel));
  RenderOptions render = RaysOf(options.pixel, options.render);
  render.gradient = gradient;
  averaged_ = options.pixel.samples > 1;
  ANCHORSPLAT_RETURN_IF_ERROR(rasterizer_.Render(cloud, RaysOf(options.pixel, camera), render, output_));
  if (averaged_) AverageRays(output_.color, options.pixel.samples, average_);
  times_.render += watch.Lap();
  return {};
}

Status ViewObjective::Show(const ObjectiveOptions& options, const CloudView& cloud, const Camera& camera) {
  return ShowCloud(options, /*gradient=*/true, cloud, camera);
}

Status ViewObjective::Show(const ObjectiveOptions& options, ConstantCloud& cloud, const Camera& camera) {
  return ShowCloud(options, /*gradient=*/false, cloud, camera);
}

Result<PhotometricLossValue> ViewObjective::Compare(const ObjectiveOptions& options, const CloudView& cloud,
                                                    const Image& picture, CloudGradient& gradient,
                                                    const CoefficientStep* step) {
  Stopwatch watch;
  PhotometricLossValue value;
  if (averaged_) {
    PixelBox box;
    ANCHORSPLAT_ASSIGN_OR_RETURN(value, PhotometricLoss(average_, picture, options.loss, average_gradient_, box));
    gradient_.box = SpreadToRays(average_gradient_, box, options.pixel.samples, gradient_.color);
  } else {
    ANCHORSPLAT_ASSIGN_OR_RETURN(value,
                                 PhotometricLoss(output_.color, picture, options.loss, gradient_.color, gradient_.box));
  }
  times_.loss += watch.Lap();
  ANCHORSPLAT_RETURN_IF_ERROR(rasterizer_.Backward(cloud, gradient_, gradient, step));
  times_.backward += watch.Lap();
  return value;
}

Result<PhotometricLossValue> ViewObjective::Evaluate(const ObjectiveOptions& options, const CloudView& cloud,
                                                     const Camera& camera, const Image& picture,
                                                     CloudGradient& gradient) {
  ANCHORSPLAT_RETURN_IF_ERROR(Show(options, cloud, camera));
  return Compare(options, cloud, picture, gradient);
}

}  // namespace anchorsplat
