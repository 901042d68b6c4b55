#include "enhance/refine_pictures.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/text.h"
#include "metrics/image_metrics.h"

namespace anchorsplat {

namespace {
constexpr int64_t kMostViews = 16;
}  // namespace

Result<PictureAgreement> MeasureAgreement(const GaussianCloud& cloud, const RenderOptions& render,
                                          PictureCache& pictures) {
  const auto count = static_cast<int64_t>(pictures.views().size());
  PictureAgreement agreement;
  agreement.views = std::min(count, kMostViews);
  Rasterizer rasterizer;
  RenderOutput output;
  std::vector<Image> shown(static_cast<size_t>(agreement.views)), truth(shown.size());
  for (size_t i = 0; i < shown.size(); ++i) {
    const int64_t view = static_cast<int64_t>(i) * count / agreement.views;
    const Camera& camera = pictures.views()[static_cast<size_t>(view)];
    ANCHORSPLAT_RETURN_IF_ERROR(pictures.Load(view, truth[i]));
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Render(cloud, camera, render, output));
    Clamp01(output.color);
    shown[i] = output.color;
  }
  for (size_t i = 0; i < shown.size(); ++i) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double own, Psnr(shown[i], truth[i]));
    agreement.psnr += std::min(own, 100.0) / static_cast<double>(agreement.views);
    const bool mismatched = std::any_of(truth.begin(), truth.end(), [&](const Image& other) {
      const auto psnr = Psnr(shown[i], other);  // fails for another size, which is no rival
      return psnr.ok() && *psnr > own;
    });
    agreement.mismatched += mismatched;
  }
  return agreement;
}

Status CheckAgreement(const PictureAgreement& agreement, double least_psnr) {
  const std::string suspicions =
      "; are these the pictures it was fitted to, in the order of their cameras, and is the splat in the cameras' "
      "coordinates?";
  if (!(agreement.psnr >= least_psnr)) {
    return Error{ErrorCode::kBadArgument,
                 Cat("--images: the splat's own renders agree with the pictures to ", Fixed(agreement.psnr, 1),
                     " dB only, mean of ", agreement.views, " views (at least ", least_psnr, " expected)", suspicions)};
  }
  if (2 * agreement.mismatched > agreement.views) {
    return Error{ErrorCode::kBadArgument,
                 Cat("--images: ", agreement.mismatched, " of ", agreement.views,
                     " views look more like the picture of another view than like their own", suspicions)};
  }
  return {};
}

}  // namespace anchorsplat
