#include "fit/view_quality.h"

#include <string>
#include <vector>

#include "core/log.h"
#include "metrics/image_metrics.h"

namespace anchorsplat {

Result<ViewQuality> MeasureQuality(const GaussianCloud& cloud, const RenderOptions& options, PictureCache& pictures,
                                   const PixelModel& pixel) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(pixel));
  Rasterizer rasterizer;
  RenderOutput output;
  Image picture, average;
  Buffer<uint8_t> ignored;
  ViewQuality sum;
  std::vector<std::string> masked;
  CloudView from_origin = cloud;
  from_origin.origin = {};
  const auto count = static_cast<int64_t>(pictures.views().size());
  for (int64_t view = 0; view < count; ++view) {
    const Camera& camera = pictures.views()[static_cast<size_t>(view)];
    ANCHORSPLAT_RETURN_IF_ERROR(pictures.Load(view, picture, ignored));
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Render(from_origin, RaysOf(pixel, camera), RaysOf(pixel, options), output));
    if (pixel.samples > 1) AverageRays(output.color, pixel.samples, average);
    Image& shown = pixel.samples > 1 ? average : output.color;
    Clamp01(shown);
    FillIgnored(ignored, shown, picture);
    ANCHORSPLAT_ASSIGN_OR_RETURN(const MaskedQuality quality, MeasureMasked(shown, picture, ignored));
    if (quality.counted == 0) {
      masked.push_back(camera.name);
      continue;
    }
    ++sum.views;
    sum.psnr += quality.psnr;
    sum.ssim += quality.ssim;
  }
  if (sum.views > 0) {
    sum.psnr /= static_cast<double>(sum.views);
    sum.ssim /= static_cast<double>(sum.views);
  }
  if (!masked.empty()) LogWarning(WhollyMasked(masked, count));
  return sum;
}

}  // namespace anchorsplat
