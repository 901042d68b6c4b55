#include "fit/view_quality.h"

#include "metrics/image_metrics.h"

namespace anchorsplat {

Result<ViewQuality> MeasureQuality(const GaussianCloud& cloud, const RenderOptions& options, PictureCache& pictures) {
  Rasterizer rasterizer;
  RenderOutput output;
  Image picture;
  ViewQuality sum;
  sum.views = static_cast<int64_t>(pictures.views().size());
  for (int64_t view = 0; view < sum.views; ++view) {
    const Camera& camera = pictures.views()[static_cast<size_t>(view)];
    ANCHORSPLAT_RETURN_IF_ERROR(pictures.Load(view, picture));
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Render(cloud, camera, options, output));
    Clamp01(output.color);
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double psnr, Psnr(output.color, picture));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double ssim, Ssim(output.color, picture));
    sum.psnr += psnr / static_cast<double>(sum.views);
    sum.ssim += ssim / static_cast<double>(sum.views);
  }
  return sum;
}

}  // namespace anchorsplat
