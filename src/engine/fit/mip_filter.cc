#include "fit/mip_filter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/activations.h"
#include "core/parallel.h"
#include "core/smoothing_filter.h"

namespace anchorsplat {

namespace {

constexpr double kFilterMargin = 0.15;  // relative to the picture's sides
constexpr int64_t kFilterRows = 4096;

}  // namespace

RenderOptions MipRendering(RenderOptions render) {
  render.mode = RenderMode::kMip;
  render.dilation = std::nullopt;
  return render;
}

Buffer<float> MipFilterSizes(std::span<const float> means, std::span<const Camera> cameras, float near_plane) {
  constexpr double kUnseen = std::numeric_limits<double>::infinity();
  const auto n = static_cast<int64_t>(means.size() / 3);
  Buffer<float> sizes(static_cast<size_t>(n));
  ParallelFor(0, n, kFilterRows, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const float* mean = means.data() + 3 * i;
      double closest = kUnseen;
      for (const Camera& camera : cameras) {
        const auto p = camera.ToCamera({mean[0], mean[1], mean[2]});
        if (!(p[2] > near_plane)) continue;
        const Pinhole& k = camera.intrinsics;
        const double x = (k.fx * p[0] / p[2] + k.cx) / k.width, y = (k.fy * p[1] / p[2] + k.cy) / k.height;
        if (!(x >= -kFilterMargin && x <= 1 + kFilterMargin && y >= -kFilterMargin && y <= 1 + kFilterMargin)) continue;
        closest = std::min(closest, p[2] / std::max(k.fx, k.fy));
      }
      sizes[static_cast<size_t>(i)] = static_cast<float>(std::sqrt(kMipVariance) * closest);
    }
  });
  float largest = 0;
  for (const float size : sizes) {
    if (std::isfinite(size)) largest = std::max(largest, size);
  }
  for (float& size : sizes) {
    if (!std::isfinite(size)) size = largest;
  }
  return sizes;
}

CloudView MipFiltered::Of(const GaussianCloud& cloud, std::span<const float> sizes) {
  log_scales.resize(cloud.log_scales.size());
  opacity_logits.resize(cloud.opacity_logits.size());
  Smooth(cloud, sizes, log_scales.data(), opacity_logits.data());
  CloudView view = cloud;
  view.log_scales = log_scales;
  view.opacity_logits = opacity_logits;
  return view;
}

void MipFilterBackward(const GaussianCloud& cloud, std::span<const float> sizes, CloudGradient& gradient) {
  ParallelFor(0, cloud.size(), kFilterRows, [&](int64_t begin, int64_t end) {
    for (auto i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      if (!(sizes[i] > 0)) continue;
      const Smoothing smoothing = SmoothingOf(cloud.log_scales.data() + 3 * i, double{sizes[i]});
      const double logit = cloud.opacity_logits[i];
      // With k the kept part and o' = k·o:  ∂logit o'/∂logit o = (1 − o)/(1 − o'),  ∂logit o'/∂ln k = 1/(1 − o'),
      // ∂ln k/∂ln s = 1 − s²/s'²,  ∂ln s'/∂ln s = s²/s'².
      const double left = smoothing.Transmittance(logit);
      if (!(left > 0)) continue;  // fully opaque, and so large that the filter changes nothing
      const double g_logit = gradient.opacity_logits[i];
      gradient.opacity_logits[i] = static_cast<float>(g_logit * Sigmoid(-logit) / left);
      for (size_t a = 0; a < 3; ++a) {
        float& g = gradient.log_scales[3 * i + a];
        const double share = smoothing.shares[a];
        g = static_cast<float>(double{g} * share + g_logit / left * (1 - share));
      }
    }
  });
}

void FuseMipFilter(std::span<const float> sizes, GaussianCloud& cloud) {
  Smooth(cloud, sizes, cloud.log_scales.data(), cloud.opacity_logits.data());
}

void CapFilteredOpacities(std::span<const float> sizes, double opacity, GaussianCloud& cloud) {
  for (size_t i = 0; i < cloud.opacity_logits.size(); ++i) {
    double kept = 1;
    if (sizes[i] > 0)
      kept = std::exp(SmoothingOf(cloud.log_scales.data() + 3 * i, double{sizes[i]}).log_opacity_factor);
    if (!(opacity < kept)) continue;  // o' < k cannot exceed it
    float& logit = cloud.opacity_logits[i];
    logit = std::min(logit, static_cast<float>(std::log(opacity / (kept - opacity))));
  }
}

}  // namespace anchorsplat
