#include "enhance/refine_copies.h"

#include <algorithm>
#include <cmath>

#include "core/log.h"
#include "core/text.h"
#include "enhance/refine_poses.h"
#include "render/constant_cloud.h"
#include "render/rasterizer.h"

namespace anchorsplat {

namespace {
constexpr int64_t kDensityViews = 16;
constexpr float kShown = 0.5f;       // alpha
constexpr double kMostPerPixel = 2;  // Gaussians, half of them unseen
}  // namespace

Result<ViewDensity> MeasureDensity(const GaussianCloud& cloud, const RenderOptions& render,
                                   const std::vector<Camera>& cameras) {
  ViewDensity density;
  const std::vector<Camera> views = SubsampleEvenly(cameras, kDensityViews);
  Rasterizer rasterizer;
  ConstantCloud still(cloud);
  const auto add = [&](size_t at, const RenderOutput& output) -> Status {
    const Camera& view = views[at];
    const auto shown = [](float alpha) { return alpha >= kShown; };
    density.pixels += static_cast<double>(std::count_if(output.alpha.pixels.begin(), output.alpha.pixels.end(), shown));
    const Pinhole& k = view.intrinsics;
    for (int64_t i = 0; i < cloud.size(); ++i) {
      const float* p = cloud.means.data() + 3 * i;
      const auto c = view.ToCamera({p[0], p[1], p[2]});
      if (!(c[2] > render.near_plane)) continue;
      const double u = k.fx * c[0] / c[2] + k.cx, v = k.fy * c[1] / c[2] + k.cy;
      if (u >= 0 && u < k.width && v >= 0 && v < k.height) density.gaussians += 1;
    }
    return {};
  };
  ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.RenderEach(still, views, render, add));
  const double count = std::max<double>(1, static_cast<double>(views.size()));
  density.pixels /= count;
  density.gaussians /= count;
  return density;
}

int ChooseCopies(const ViewDensity& density, double upscale, int wanted, int64_t input, int64_t start) {
  const double each = static_cast<double>(start) / static_cast<double>(std::max<int64_t>(1, input));
  const int copies = std::max(1, static_cast<int>(std::lround(wanted / each)));
  const double pixels = density.pixels * upscale * upscale, gaussians = density.gaussians * each;
  const int most = static_cast<int>(std::clamp(kMostPerPixel * pixels / std::max(1.0, gaussians), 1.0, 1e6));
  const int chosen = std::min(copies, most);
  LogInfo(Cat(chosen == 1 ? "splitting no Gaussian" : Cat("splitting every Gaussian into ", chosen),
              chosen < copies ? Cat(", not ", copies) : "", ": a closer view has about ",
              WithThousands(std::llround(pixels)), " pixels for ", WithThousands(std::llround(gaussians)),
              " Gaussians. --k overrides"));
  return chosen;
}

}  // namespace anchorsplat
