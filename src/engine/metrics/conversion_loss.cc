#include "metrics/conversion_loss.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/camera.h"
#include "core/framing.h"
#include "metrics/image_metrics.h"
#include "render/rasterizer.h"
#include "render/shown_range.h"

namespace anchorsplat {

namespace {

constexpr int kSide = 400;            // pixels; loss shows at any size, and this one is fast
constexpr double kFieldOfView = 0.8;  // radians

}  // namespace

Result<ConversionLoss> MeasureConversionLoss(const CloudView& before, const CloudView& after, int views) {
  const Framing framing = FrameCloud(before);
  const Pinhole intrinsics = PinholeFromFov(kSide, kSide, kFieldOfView);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const CameraSet orbit,
                               OrbitCameras(views, FramingDistance(framing, intrinsics), framing.target, intrinsics));
  Rasterizer rasterizer;
  RenderOutput first, second;
  RenderOptions options = DisplayOptions(before);
  // A format that cannot store the mode has not changed it.
  options.mode = before.render_mode.value_or(after.render_mode.value_or(RenderMode::kClassic));
  ConversionLoss loss;
  loss.views = views;
  loss.min_psnr = std::numeric_limits<double>::infinity();
  double squares = 0;
  for (const Camera& camera : orbit.cameras) {
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Render(before, camera, options, first));
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Render(after, camera, options, second));
    Clamp01(first.color);
    Clamp01(second.color);
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double psnr, Psnr(first.color, second.color));
    loss.min_psnr = std::min(loss.min_psnr, psnr);
    squares += std::pow(10, -psnr / 10);
  }
  loss.mean_psnr = -10 * std::log10(squares / views);
  return loss;
}

}  // namespace anchorsplat
