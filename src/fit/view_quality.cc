#include "fit/view_quality.h"

#include <algorithm>
#include <cmath>

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
  sum.views = static_cast<int64_t>(pictures.views().size());
  for (int64_t view = 0; view < sum.views; ++view) {
    const Camera& camera = pictures.views()[static_cast<size_t>(view)];
    ANCHORSPLAT_RETURN_IF_ERROR(pictures.Load(view, picture, ignored));
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Render(cloud, RaysOf(pixel, camera), RaysOf(pixel, options), output));
    if (pixel.samples > 1) AverageRays(output.color, pixel.samples, average);
    Image& shown = pixel.samples > 1 ? average : output.color;
    Clamp01(shown);
    FillIgnored(ignored, shown, picture);
    // Means over all pixels of what is 0 for the ignored ones become means over the others.
    const double counted = static_cast<double>(picture.plane() - std::count(ignored.begin(), ignored.end(), 1));
    const double share = std::max(counted, 1.0) / static_cast<double>(picture.plane());
    ANCHORSPLAT_ASSIGN_OR_RETURN(double psnr, Psnr(shown, picture));
    ANCHORSPLAT_ASSIGN_OR_RETURN(double ssim, Ssim(shown, picture));
    psnr += 10 * std::log10(share);
    ssim = 1 - (1 - ssim) / share;
    sum.psnr += psnr / static_cast<double>(sum.views);
    sum.ssim += ssim / static_cast<double>(sum.views);
  }
  return sum;
}

}  // namespace anchorsplat
