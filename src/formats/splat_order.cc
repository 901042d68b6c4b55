#include "formats/splat_order.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/activations.h"
#include "core/parallel.h"
#include "core/parallel_sort.h"

namespace anchorsplat {

namespace {

constexpr int64_t kOrderGrain = 1 << 16;

template <typename Key>
struct Keyed {
  Key key;
  uint32_t row;
  // A total order, so that the result does not depend on how the sort was split among threads.
  bool operator<(const Keyed& other) const { return key != other.key ? key < other.key : row < other.row; }
};

template <typename Key, typename KeyOf>
Buffer<uint32_t> OrderBy(int64_t count, KeyOf&& key_of) {
  Buffer<Keyed<Key>> keyed(static_cast<size_t>(count));
  ParallelFor(0, count, kOrderGrain, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) keyed[static_cast<size_t>(i)] = {key_of(i), static_cast<uint32_t>(i)};
  });
  ParallelSort(keyed.begin(), keyed.end());
  Buffer<uint32_t> rows(keyed.size());
  ParallelFor(0, count, kOrderGrain, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) rows[static_cast<size_t>(i)] = keyed[static_cast<size_t>(i)].row;
  });
  return rows;
}

// The 21 low bits of x with two zero bits after each.
uint64_t SpreadBits(uint64_t x) {
  x = (x | x << 32) & 0x001f00000000ffff;
  x = (x | x << 16) & 0x001f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  return (x | x << 2) & 0x1249249249249249;
}

}  // namespace

Buffer<uint32_t> MortonOrder(const CloudView& cloud) {
  const std::optional<Bounds> bounds = ComputeBounds(cloud);
  constexpr double kCells = 1 << 21;
  double scale[3] = {0, 0, 0};
  double origin[3] = {0, 0, 0};
  for (size_t a = 0; bounds && a < 3; ++a) {
    const double extent = double{bounds->max[a]} - double{bounds->min[a]};
    origin[a] = bounds->min[a];
    scale[a] = extent > 0 ? kCells / extent : 0;
  }
  return OrderBy<uint64_t>(cloud.size(), [&](int64_t i) {
    const float* mean = cloud.means.data() + 3 * i;
    uint64_t code = 0;
    for (int a = 0; a < 3; ++a) {
      if (!std::isfinite(mean[a])) return std::numeric_limits<uint64_t>::max();
      const double cell = (double{mean[a]} - origin[a]) * scale[a];
      code |= SpreadBits(static_cast<uint64_t>(cell < kCells - 1 ? cell : kCells - 1)) << a;
    }
    return code;
  });
}

Buffer<uint32_t> ImportanceOrder(const CloudView& cloud) {
  return OrderBy<float>(cloud.size(), [&](int64_t i) {
    const float* s = cloud.log_scales.data() + 3 * i;
    const float logit = cloud.opacity_logits[static_cast<size_t>(i)];
    // Flat Gaussians (a log-scale of −Inf) are seen all the same; NaN stays.
    const auto bounded = [](float log_scale) { return std::max(log_scale, -20.0f); };
    const float importance = bounded(s[0]) + bounded(s[1]) + bounded(s[2]) + LogSigmoid(logit);
    return std::isnan(importance) ? std::numeric_limits<float>::infinity() : -importance;
  });
}

Buffer<uint32_t> WriteOrder(const CloudView& cloud, SplatOrder asked, SplatOrder of_format) {
  const SplatOrder order = asked == SplatOrder::kFormat ? of_format : asked;
  if (order == SplatOrder::kMorton) return MortonOrder(cloud);
  if (order == SplatOrder::kImportance) return ImportanceOrder(cloud);
  return {};
}

}  // namespace anchorsplat
