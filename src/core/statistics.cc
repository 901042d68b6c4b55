#include "core/statistics.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "core/activations.h"
#include "core/parallel.h"

namespace anchorsplat {

namespace {

Percentiles ComputePercentiles(std::span<float> values) {
  Percentiles out;
  for (size_t k = 0; k < out.size(); ++k) out[k] = Quantile(values, kPercentiles[k]);
  return out;
}

bool IsPlausible(const CloudView& cloud, int64_t i) {
  static const float kLongest = std::log(kPlausibleExtent);
  const float* mean = cloud.means.data() + 3 * i;
  const float* scale = cloud.log_scales.data() + 3 * i;
  return std::all_of(mean, mean + 3, [](float x) { return std::fabs(x) <= kPlausibleExtent; }) &&
         std::all_of(scale, scale + 3, [](float x) { return x <= kLongest; });
}

// Rows whose mean leaves the box of the middle 98 %, grown tenfold about its centre, along any axis.
int64_t CountOutliers(const CloudView& cloud) {
  std::array<float, 3> low, high;
  Buffer<float> axis;
  for (size_t a = 0; a < 3; ++a) {
    axis.clear();
    for (size_t i = a; i < cloud.means.size(); i += 3) {
      if (std::isfinite(cloud.means[i])) axis.push_back(cloud.means[i]);
    }
    const float first = Quantile(axis, 0.01), last = Quantile(axis, 0.99);
    const float centre = 0.5f * (first + last), half = 0.5f * (last - first);
    low[a] = centre - 10 * half;
    high[a] = centre + 10 * half;
  }
  int64_t outside = 0;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    const float* p = cloud.means.data() + 3 * i;
    bool out = false;
    for (size_t a = 0; a < 3; ++a) out |= std::isfinite(p[a]) && (p[a] < low[a] || p[a] > high[a]);
    outside += out ? 1 : 0;
  }
  return outside;
}

}  // namespace

float Quantile(std::span<float> values, double q) {
  if (values.empty()) return std::numeric_limits<float>::quiet_NaN();
  const double at = std::clamp(q, 0.0, 1.0) * static_cast<double>(values.size() - 1);
  const auto below = static_cast<size_t>(at);
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(below);
  std::nth_element(values.begin(), nth, values.end());
  const float low = *nth;
  const double fraction = at - static_cast<double>(below);
  if (fraction == 0) return low;
  const float high = *std::min_element(nth + 1, values.end());
  if (low == high) return low;  // infinite ones have no difference
  return static_cast<float>(low + fraction * (static_cast<double>(high) - low));
}

int64_t CountUnusable(const CloudView& cloud, bool harmonics) {
  constexpr int64_t kGrain = 1 << 14;
  std::atomic<int64_t> sum = 0;
  ParallelFor(0, cloud.size(), kGrain, [&](int64_t first, int64_t last) {
    int64_t here = 0;
    for (int64_t i = first; i < last; ++i) here += (harmonics ? IsUsable(cloud, i) : HasUsableShape(cloud, i)) ? 0 : 1;
    sum += here;
  });
  return sum;
}

CloudStatistics ComputeStatistics(const CloudView& cloud) {
  CloudStatistics out;
  out.gaussians = cloud.size();
  out.sh_degree = cloud.sh_degree;
  out.bounds = ComputeBounds(cloud);

  Buffer<float> largest, smallest, ratio, opacity;
  int64_t usable = 0, positive_scales = 0, unit_opacities = 0;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (!IsUsable(cloud, i)) {
      ++out.not_finite;
      continue;
    }
    ++usable;
    if (!IsPlausible(cloud, i)) ++out.implausible;
    const float* q = cloud.quats.data() + 4 * i;
    const double norm =
        std::sqrt(double{q[0]} * q[0] + double{q[1]} * q[1] + double{q[2]} * q[2] + double{q[3]} * q[3]);
    if (norm < 1e-12) {
      ++out.zero_quaternions;
    } else if (std::abs(norm - 1) > 0.01) {
      ++out.unnormalised_quaternions;
    }
    const float logit = cloud.opacity_logits[static_cast<size_t>(i)];
    const float alpha = Sigmoid(logit);
    opacity.push_back(alpha);
    if (alpha < 1.0f / 255) ++out.invisible;
    if (logit >= 0 && logit <= 1) ++unit_opacities;

    const float* s = cloud.log_scales.data() + 3 * i;
    const auto [low, high] = std::minmax({s[0], s[1], s[2]});
    if (low >= 0) ++positive_scales;
    if (!std::isfinite(low)) ++out.zero_scales;
    if (!std::isfinite(high)) continue;
    largest.push_back(std::exp(high));
    smallest.push_back(std::exp(low));
    if (std::isfinite(low)) ratio.push_back(std::exp(high - low));
  }
  out.largest_axis = ComputePercentiles(largest);
  out.smallest_axis = ComputePercentiles(smallest);
  out.axis_ratio = ComputePercentiles(ratio);
  out.opacity = ComputePercentiles(opacity);
  out.outliers = CountOutliers(cloud);

  // Logarithms of lengths are negative for anything shorter than one unit, and a splat whose Gaussians are all longer
  // than the box that holds them is no splat. Logits inside 0–1 would be opacities of 50–73 % only.
  if (out.bounds && usable > 0) {
    float extent = 0;
    for (size_t a = 0; a < 3; ++a) extent = std::max(extent, out.bounds->max[a] - out.bounds->min[a]);
    const double share = static_cast<double>(positive_scales) / static_cast<double>(usable);
    out.linear_looking_scales = share > 0.99 && out.largest_axis[2] > extent;
    out.linear_looking_opacities =
        usable >= 100 && static_cast<double>(unit_opacities) > 0.99 * static_cast<double>(usable);
  }
  return out;
}

}  // namespace anchorsplat
