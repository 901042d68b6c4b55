#include "train/seen_gaussians.h"

#include <algorithm>

#include "core/spherical_harmonics.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// The picture's sum is linear in a Gaussian's colour, with its summed weights as the factor. So the gradient of that
// sum by a colour coefficient gives the weights. All colours are set to 0.5, where none is clamped.
Result<SeenGaussians> SeenGaussians::Look(const GaussianCloud& cloud, std::span<const Camera> cameras,
                                          std::span<const size_t> views) {
  GaussianCloud grey = WithShDegree(cloud, 0);
  std::fill(grey.sh.begin(), grey.sh.end(), 0.0f);
  SeenGaussians seen;
  seen.count_ = cloud.size();
  seen.seen_.resize(cameras.size());
  RenderOptions options;
  options.mode = cloud.render_mode.value_or(RenderMode::kClassic);
  options.gradient = true;
  Rasterizer rasterizer;
  RenderOutput output;
  RenderGradient one;
  CloudGradient gradient;
  for (const size_t view : views) {
    const Camera& camera = cameras[view];
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Render(grey, camera, options, output));
    one.color = Image(camera.intrinsics.width, camera.intrinsics.height, 3);
    std::fill_n(one.color.pixels.begin(), one.color.plane(), 1.0f);  // red only
    std::fill(one.color.pixels.begin() + one.color.plane(), one.color.pixels.end(), 0.0f);
    one.box = {0, 0, camera.intrinsics.width, camera.intrinsics.height};
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Backward(grey, one, gradient));
    for (int64_t i = 0; i < seen.count_; ++i) {
      seen.seen_[view].push_back(double{gradient.sh[static_cast<size_t>(3 * i)]} > kSeenPixels * double{kSh0});
    }
  }
  return seen;
}

}  // namespace anchorsplat
