#include "eval/filter_sweep.h"

#include <algorithm>
#include <cmath>

#include "enhance/filter.h"
#include "fit/picture_cache.h"
#include "metrics/image_metrics.h"

namespace anchorsplat {

namespace {

constexpr double kStrengths[] = {0, 0.25, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.5};
constexpr size_t kMostViews = 20;

}  // namespace

std::span<const double> FilterStrengths() { return kStrengths; }

Result<CameraPixelSizes> TruePixelSizes(const BenchmarkObject& object) {
  return PixelSizesFromCameras(object.low, object.low_cameras, object.camera_rule);
}

double TopOfParabola(std::span<const double> x, std::span<const double> y) {
  const size_t k = static_cast<size_t>(std::max_element(y.begin(), y.end()) - y.begin());
  if (k == 0 || k + 1 == y.size()) return x[k];
  // Slopes on both sides; a parabola's slope is linear between the two midpoints.
  const double left = (y[k] - y[k - 1]) / (x[k] - x[k - 1]), right = (y[k + 1] - y[k]) / (x[k + 1] - x[k]);
  const double from = (x[k - 1] + x[k]) / 2, to = (x[k] + x[k + 1]) / 2;
  const double top = from + (to - from) * left / (left - right);
  return std::isfinite(top) ? std::clamp(top, x[k - 1], x[k + 1]) : x[k];
}

Result<double> BestFilterStrength(const MethodTask& task) {
  const BenchmarkObject& object = task.object;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const CameraPixelSizes sizes, TruePixelSizes(object));
  std::vector<MethodViews> candidates;
  for (const double f : kStrengths) {
    GaussianCloud cloud = object.low;
    const auto grown = ApplyFilter(cloud, sizes.sizes, {.upscale = object.upscale(), .strength = f});
    if (!grown.ok()) return grown.error();
    candidates.push_back(SplatViews(object, std::move(cloud)));
  }
  std::vector<double> psnr(candidates.size());
  for (const size_t view : SubsampleEvenly({task.views.begin(), task.views.end()}, kMostViews)) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const ViewPicture truth, object.Truth(view));
    for (size_t k = 0; k < candidates.size(); ++k) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(Image image, candidates[k].render(view));
      TreatRender(task.protocol, image);
      FillIgnored(truth.ignored, truth.image, image);
      ANCHORSPLAT_ASSIGN_OR_RETURN(const MaskedQuality quality, MeasureMasked(image, truth.image, truth.ignored));
      psnr[k] += quality.psnr;
    }
  }
  return TopOfParabola(kStrengths, psnr);
}

}  // namespace anchorsplat
