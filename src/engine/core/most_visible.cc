#include "core/most_visible.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "core/activations.h"

namespace anchorsplat {

std::vector<int64_t> MostVisible(const GaussianCloud& cloud, std::span<const int64_t> rows, int64_t count) {
  std::vector<float> log_weight(rows.size());
  for (size_t j = 0; j < rows.size(); ++j) {
    if (!IsDrawn(cloud, rows[j])) {
      log_weight[j] = -std::numeric_limits<float>::infinity();
      continue;
    }
    const float* s = cloud.log_scales.data() + 3 * rows[j];
    const float logit = cloud.opacity_logits[static_cast<size_t>(rows[j])];
    // The sum without the smallest: subtracting it would fail for −Inf (flat Gaussians). Needles and points rank above
    // what is not drawn.
    const float largest = std::max({s[0] + s[1], s[0] + s[2], s[1] + s[2]});
    log_weight[j] = LogSigmoid(logit) + std::max(largest, std::numeric_limits<float>::lowest());
  }
  std::vector<size_t> order(rows.size());
  std::iota(order.begin(), order.end(), size_t{0});
  const auto more = [&](size_t a, size_t b) {
    return log_weight[a] != log_weight[b] ? log_weight[a] > log_weight[b] : a < b;
  };
  count = std::min(count, int64_t{std::ssize(rows)});
  std::nth_element(order.begin(), order.begin() + count, order.end(), more);
  order.resize(static_cast<size_t>(count));
  std::sort(order.begin(), order.end());
  std::vector<int64_t> kept;
  kept.reserve(order.size());
  for (const size_t j : order) kept.push_back(rows[j]);
  return kept;
}

std::vector<int64_t> MostVisible(const GaussianCloud& cloud, int64_t count) {
  std::vector<int64_t> rows(static_cast<size_t>(cloud.size()));
  std::iota(rows.begin(), rows.end(), int64_t{0});
  return MostVisible(cloud, rows, count);
}

}  // namespace anchorsplat
