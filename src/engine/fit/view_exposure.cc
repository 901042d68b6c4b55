#include "fit/view_exposure.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include "core/parallel.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr int64_t kExposureGrain = 1 << 14;  // pixels per task
constexpr double kRidge = 1e-4;              // per pixel; a contrast of 1 % outweighs it
constexpr double kSigmaOfMedian = 1.4826;
constexpr float kSigmas = 6;
constexpr float kVisible = 0.5f / 255;  // smaller differences are plain background, not noise

Status CheckSizes(const Image& a, const Image& b) {
  if (a.width == b.width && a.height == b.height && a.channels == 3 && b.channels == 3) return {};
  return Error{ErrorCode::kBadArgument, Cat("pictures of ", a.width, " x ", a.height, " x ", a.channels, " and ",
                                            b.width, " x ", b.height, " x ", b.channels, " cannot be compared")};
}

struct Sums {
  double x = 0, y = 0, xx = 0, xy = 0;
};

}  // namespace

Result<ViewExposure> EstimateExposure(const Image& rendered, const Image& target) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckSizes(rendered, target));
  ViewExposure exposure;
  const int64_t plane = rendered.plane();
  if (plane == 0) return exposure;
  std::vector<Sums> parts(static_cast<size_t>((plane + kExposureGrain - 1) / kExposureGrain));
  for (int c = 0; c < 3; ++c) {
    const float* r = rendered.channel(c);
    const float* t = target.channel(c);
    ParallelFor(0, plane, kExposureGrain, [&](int64_t first, int64_t last) {
      Sums sums;
      for (int64_t i = first; i < last; ++i) {
        const double x = r[i], y = t[i];
        sums.x += x, sums.y += y, sums.xx += x * x, sums.xy += x * y;
      }
      parts[static_cast<size_t>(first / kExposureGrain)] = sums;
    });
    Sums all;
    for (const Sums& part : parts) all.x += part.x, all.y += part.y, all.xx += part.xx, all.xy += part.xy;
    // (Σxx + λ)·a + Σx·b = Σxy + λ,  Σx·a + (n + λ)·b = Σy.
    const double n = static_cast<double>(plane), ridge = kRidge * n;
    const double det = (all.xx + ridge) * (n + ridge) - all.x * all.x;
    const double gain = ((all.xy + ridge) * (n + ridge) - all.x * all.y) / det;
    if (!std::isfinite(gain)) continue;
    const auto k = static_cast<size_t>(c);
    exposure.gain[k] = std::clamp(gain, 0.5, 2.0);
    exposure.bias[k] = (all.y - exposure.gain[k] * all.x) / (n + ridge);
  }
  return exposure;
}

void RemoveExposure(const ViewExposure& exposure, Image& target) {
  for (int c = 0; c < 3; ++c) {
    const auto k = static_cast<size_t>(c);
    const auto scale = static_cast<float>(1 / exposure.gain[k]);
    const auto shift = static_cast<float>(-exposure.bias[k] / exposure.gain[k]);
    float* t = target.channel(c);
    ParallelFor(0, target.plane(), kExposureGrain, [&](int64_t first, int64_t last) {
      for (int64_t i = first; i < last; ++i) t[i] = scale * t[i] + shift;
    });
  }
}

Result<int64_t> IgnoreOutliers(const Image& rendered, float least, Image& target) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckSizes(rendered, target));
  const int64_t plane = rendered.plane();
  std::vector<float> worst(static_cast<size_t>(plane));  // maximum over channels
  for (int64_t i = 0; i < plane; ++i) {
    float difference = 0;
    for (int c = 0; c < 3; ++c)
      difference = std::max(difference, std::abs(rendered.channel(c)[i] - target.channel(c)[i]));
    worst[static_cast<size_t>(i)] = difference;
  }
  std::vector<float> visible;
  std::copy_if(worst.begin(), worst.end(), std::back_inserter(visible), [](float d) { return d > kVisible; });
  if (visible.empty()) return int64_t{0};
  const auto middle = visible.begin() + static_cast<ptrdiff_t>(visible.size() / 2);
  std::nth_element(visible.begin(), middle, visible.end());
  const float bound = std::max(least, kSigmas * static_cast<float>(kSigmaOfMedian) * *middle);
  int64_t ignored = 0;
  for (int64_t i = 0; i < plane; ++i) {
    if (worst[static_cast<size_t>(i)] <= bound) continue;
    ++ignored;
    for (int c = 0; c < 3; ++c) target.channel(c)[i] = rendered.channel(c)[i];
  }
  return ignored;
}

}  // namespace anchorsplat
