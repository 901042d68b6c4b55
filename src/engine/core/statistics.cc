#include "core/statistics.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace anchorsplat {

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
  if (low == high) return low;  // avoids Inf − Inf
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

}  // namespace anchorsplat
