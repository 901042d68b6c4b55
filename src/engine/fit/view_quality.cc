#include "fit/view_quality.h"

#include <string>
#include <vector>

#include "core/log.h"
#include "core/run_context.h"
#include "metrics/image_metrics.h"
#include "render/constant_cloud.h"

namespace anchorsplat {

Result<ViewQuality> MeasureQuality(const GaussianCloud& cloud, const RenderOptions& options, PictureCache& pictures,
                                   const PixelModel& pixel) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(pixel));
  Image picture, average;
  Buffer<uint8_t> ignored;
  ViewQuality sum;
  std::vector<std::string> masked;
  CloudView from_origin = cloud;
  from_origin.origin = {};
  const auto count = static_cast<int64_t>(pictures.views().size());
  std::vector<Camera> rays;
  for (const Camera& camera : pictures.views()) rays.push_back(RaysOf(pixel, camera));
  const auto add = [&](size_t view, RenderOutput& output) -> Status {
    if (StopRequested()) return Error{ErrorCode::kInterrupted, "stopped while the result was measured"};
    ANCHORSPLAT_RETURN_IF_ERROR(pictures.Load(static_cast<int64_t>(view), picture, ignored));
    if (pixel.samples > 1) AverageRays(output.color, pixel.samples, average);
    Image& shown = pixel.samples > 1 ? average : output.color;
    Clamp01(shown);
    FillIgnored(ignored, shown, picture);
    ANCHORSPLAT_ASSIGN_OR_RETURN(const MaskedQuality quality, MeasureMasked(shown, picture, ignored));
    if (quality.counted == 0) {
      masked.push_back(rays[view].name);
      return {};
    }
    ++sum.views;
    sum.psnr += quality.psnr;
    sum.ssim += quality.ssim;
    return {};
  };
  ConstantCloud still(from_origin);
  Rasterizer rasterizer;
  ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.RenderEach(still, rays, RaysOf(pixel, options), add));
  if (sum.views > 0) {
    sum.psnr /= static_cast<double>(sum.views);
    sum.ssim /= static_cast<double>(sum.views);
  }
  if (!masked.empty()) LogWarning(WhollyMasked(masked, count));
  return sum;
}

}  // namespace anchorsplat
