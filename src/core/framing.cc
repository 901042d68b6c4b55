#include "core/framing.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/finite.h"
#include "core/statistics.h"

namespace anchorsplat {

namespace {
constexpr float kVisibleLogit = -2.2f;  // opacity 10 %: haze around an object should not move the camera
// Of larger clouds every so many Gaussians are looked at: quantiles of half a million are off by a thousandth of the
// Gaussians at most.
constexpr int64_t kMostLookedAt = 1'000'000;
}  // namespace

Framing FrameCloud(const CloudView& cloud) {
  const int64_t step = std::max<int64_t>(1, (cloud.size() + kMostLookedAt - 1) / kMostLookedAt);
  const auto collect = [&](auto&& value, float least_logit) {
    Buffer<float> out;
    for (int64_t i = 0; i < cloud.size(); i += step) {
      const float* p = cloud.means.data() + 3 * i;
      if (!AllFinite(p, 3)) continue;
      if (cloud.opacity_logits[static_cast<size_t>(i)] >= least_logit) out.push_back(value(p));
    }
    return out;
  };
  // A cloud of haze only is framed whole.
  const float least = collect([](const float*) { return 0.0f; }, kVisibleLogit).empty()
                          ? -std::numeric_limits<float>::infinity()
                          : kVisibleLogit;
  Framing framing;
  for (size_t a = 0; a < 3; ++a) {
    Buffer<float> axis = collect([a](const float* p) { return p[a]; }, least);
    if (axis.empty()) return framing;
    framing.target[a] = 0.5 * (double{Quantile(axis, 0.01)} + Quantile(axis, 0.99));
  }
  Buffer<float> distances = collect(
      [&](const float* p) {
        double sum = 0;
        for (size_t a = 0; a < 3; ++a) sum += (p[a] - framing.target[a]) * (p[a] - framing.target[a]);
        return static_cast<float>(std::sqrt(sum));
      },
      least);
  const double radius = Quantile(distances, 0.98);
  if (radius > 0 && std::isfinite(radius)) {
    framing.radius = radius;
    return framing;
  }
  double largest = 0;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (!(cloud.opacity_logits[static_cast<size_t>(i)] >= least)) continue;
    for (size_t a = 0; a < 3; ++a) {
      const double reach = 3 * std::exp(double{cloud.log_scales[static_cast<size_t>(3 * i) + a]});
      if (std::isfinite(reach)) largest = std::max(largest, reach);
    }
  }
  if (largest > 0) framing.radius = largest;
  return framing;
}

double FramingDistance(const Framing& framing, const Pinhole& intrinsics) {
  const double half = std::min(0.5 * intrinsics.width / intrinsics.fx, 0.5 * intrinsics.height / intrinsics.fy);
  return 1.1 * framing.radius / std::sin(std::atan(half));
}

}  // namespace anchorsplat
