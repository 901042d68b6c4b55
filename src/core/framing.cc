#include "core/framing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "core/finite.h"
#include "core/statistics.h"

namespace anchorsplat {

namespace {
constexpr float kVisibleLogit = -2.2f;  // opacity 10 %: haze around an object should not move the camera
// Of larger clouds every so many Gaussians are looked at: quantiles of half a million are off by a thousandth of the
// Gaussians at most.
constexpr int64_t kMostLookedAt = 1'000'000;

constexpr float kAnyLogit = -std::numeric_limits<float>::infinity();

int64_t StepOf(int64_t gaussians) { return std::max<int64_t>(1, (gaussians + kMostLookedAt - 1) / kMostLookedAt); }

// 3 σ of the longest axis among Gaussians of `least_logit` or more.
double LargestReach(const CloudView& cloud, float least_logit) {
  double largest = 0;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (!(cloud.opacity_logits[static_cast<size_t>(i)] >= least_logit)) continue;
    for (size_t a = 0; a < 3; ++a) {
      const double reach = 3 * std::exp(double{cloud.log_scales[static_cast<size_t>(3 * i) + a]});
      if (std::isfinite(reach)) largest = std::max(largest, reach);
    }
  }
  return largest;
}

// Of the Gaussians that are looked at. `reach` (least logit): LargestReach of all.
template <typename Reach>
Framing FrameSample(std::span<const float> means, std::span<const float> opacity_logits, Reach&& reach) {
  const auto collect = [&](auto&& value, float least_logit) {
    Buffer<float> out;
    for (size_t k = 0; k < opacity_logits.size(); ++k) {
      const float* p = means.data() + 3 * k;
      if (AllFinite(p, 3) && opacity_logits[k] >= least_logit) out.push_back(value(p));
    }
    return out;
  };
  // A cloud of haze only is framed whole.
  const float least = collect([](const float*) { return 0.0f; }, kVisibleLogit).empty() ? kAnyLogit : kVisibleLogit;
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
  } else if (const double largest = reach(least); largest > 0) {
    framing.radius = largest;
  }
  return framing;
}

}  // namespace

namespace {

Framing FrameFromOrigin(const CloudView& cloud) {
  const int64_t step = StepOf(cloud.size());
  const auto reach = [&](float least_logit) { return LargestReach(cloud, least_logit); };
  if (step == 1) return FrameSample(cloud.means, cloud.opacity_logits, reach);
  Buffer<float> means, opacity_logits;
  for (int64_t i = 0; i < cloud.size(); i += step) {
    const float* p = cloud.means.data() + 3 * i;
    means.insert(means.end(), p, p + 3);
    opacity_logits.push_back(cloud.opacity_logits[static_cast<size_t>(i)]);
  }
  return FrameSample(means, opacity_logits, reach);
}

}  // namespace

Framing FrameCloud(const CloudView& cloud) {
  Framing framing = FrameFromOrigin(cloud);
  for (size_t a = 0; a < 3; ++a) framing.target[a] += cloud.origin[a];
  return framing;
}

FramingStudy::FramingStudy(int64_t gaussians) : step_(StepOf(gaussians)) {
  const auto looked_at = static_cast<size_t>((gaussians + step_ - 1) / step_);
  means_.resize(3 * looked_at);
  opacity_logits_.resize(looked_at);
}

void FramingStudy::Look(int64_t first, const CloudView& rows) {
  const int64_t next = (first + step_ - 1) / step_ * step_;
  for (int64_t i = next; i < first + rows.size(); i += step_) {
    std::copy_n(rows.means.data() + 3 * (i - first), 3, means_.data() + 3 * (i / step_));
    opacity_logits_[static_cast<size_t>(i / step_)] = rows.opacity_logits[static_cast<size_t>(i - first)];
  }
  // Of all rows only what is longest matters; exponentials are for few.
  float any = kAnyLogit, visible = kAnyLogit;
  double reach = 0, visible_reach = 0;
  for (size_t k = 0; k < rows.log_scales.size(); ++k) {
    const float scale = rows.log_scales[k], logit = rows.opacity_logits[k / 3];
    if (!(scale > any || scale > visible) || std::isnan(logit)) continue;
    const double here = 3 * std::exp(double{scale});
    if (!std::isfinite(here)) continue;
    if (scale > any) {
      any = scale;
      reach = here;
    }
    if (logit >= kVisibleLogit && scale > visible) {
      visible = scale;
      visible_reach = here;
    }
  }
  const std::lock_guard lock(mutex_);
  reach_ = std::max(reach_, reach);
  visible_reach_ = std::max(visible_reach_, visible_reach);
}

Framing FramingStudy::Find() const {
  return FrameSample(means_, opacity_logits_,
                     [&](float least_logit) { return least_logit == kVisibleLogit ? visible_reach_ : reach_; });
}

double FramingDistance(const Framing& framing, const Pinhole& intrinsics) {
  const double half = std::min(0.5 * intrinsics.width / intrinsics.fx, 0.5 * intrinsics.height / intrinsics.fy);
  return 1.1 * framing.radius / std::sin(std::atan(half));
}

}  // namespace anchorsplat
