#include "formats/splat_order.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "core/activations.h"
#include "core/parallel.h"
#include "core/parallel_sort.h"
#include "core/statistics.h"
#include "formats/strays.h"

namespace anchorsplat {

namespace {

constexpr int64_t kOrderGrain = 1 << 16;

template <typename Key>
struct Keyed {
  Key key;
  uint32_t row;
  // A total order, so that the result does not depend on threads.
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

// The 21 low bits of x, each followed by two zero bits.
uint64_t SpreadBits(uint64_t x) {
  x = (x | x << 32) & 0x001f00000000ffff;
  x = (x | x << 16) & 0x001f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  return (x | x << 2) & 0x1249249249249249;
}

enum class Part : uint8_t { kNear, kFarOut, kNobodyDraws };

// Placement of the curve: its first cell, and cells per world unit.
struct Curve {
  static constexpr double kCells = 1 << 21;
  double origin[3] = {0, 0, 0}, scale[3] = {0, 0, 0};

  uint64_t CodeOf(const float* mean) const {
    uint64_t code = 0;
    for (int a = 0; a < 3; ++a) {
      const double cell = (double{mean[a]} - origin[a]) * scale[a];
      code |= SpreadBits(static_cast<uint64_t>(cell < kCells - 1 ? cell : kCells - 1)) << a;
    }
    return code;
  }
};

// Along a curve through the box of the near Gaussians, then along one through that of the strays.
template <typename PartOf>
Buffer<uint32_t> OrderAlongCurve(std::span<const float> means, PartOf&& part_of) {
  const int64_t count = std::ssize(means) / 3;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Buffer<Part> parts(static_cast<size_t>(count));
  Curve curves[2];
  double high[2][3];
  for (int k = 0; k < 2; ++k) {
    std::fill_n(curves[k].origin, 3, kInfinity);
    std::fill_n(high[k], 3, -kInfinity);
  }
  for (int64_t i = 0; i < count; ++i) {
    const Part part = parts[static_cast<size_t>(i)] = part_of(i);
    if (part == Part::kNobodyDraws) continue;
    const int k = part == Part::kNear ? 0 : 1;
    for (int a = 0; a < 3; ++a) {
      const double x = means[static_cast<size_t>(3 * i + a)];
      curves[k].origin[a] = std::min(curves[k].origin[a], x);
      high[k][a] = std::max(high[k][a], x);
    }
  }
  for (int k = 0; k < 2; ++k) {
    for (int a = 0; a < 3; ++a) {
      const double extent = high[k][a] - curves[k].origin[a];
      curves[k].scale[a] = extent > 0 ? Curve::kCells / extent : 0;
    }
  }
  constexpr uint64_t kFarOut = uint64_t{1} << 63;  // codes have 63 bits
  return OrderBy<uint64_t>(count, [&](int64_t i) {
    const Part part = parts[static_cast<size_t>(i)];
    if (part == Part::kNobodyDraws) return std::numeric_limits<uint64_t>::max();
    const float* mean = means.data() + 3 * i;
    return part == Part::kNear ? curves[0].CodeOf(mean) : kFarOut | curves[1].CodeOf(mean);
  });
}

}  // namespace

Buffer<uint32_t> MortonOrder(const CloudView& cloud) {
  const std::optional<Framing> framing = FramingWithFarOut(cloud);
  return OrderAlongCurve(cloud.means, [&](int64_t i) {
    if (!HasUsableShape(cloud, i)) return Part::kNobodyDraws;
    return framing && IsFarOut(*framing, cloud.means.data() + 3 * i) ? Part::kFarOut : Part::kNear;
  });
}

Buffer<uint32_t> MortonOrder(std::span<const float> means) {
  return OrderAlongCurve(means, [](int64_t) { return Part::kNear; });
}

Buffer<uint32_t> ImportanceOrder(const CloudView& cloud) {
  return OrderBy<float>(cloud.size(), [&](int64_t i) {
    if (!IsDrawn(cloud, i)) return std::numeric_limits<float>::infinity();
    const float* s = cloud.log_scales.data() + 3 * i;
    const float logit = cloud.opacity_logits[static_cast<size_t>(i)];
    // Flat Gaussians (log-scale −Inf) are visible too.
    const auto bounded = [](float log_scale) { return std::max(log_scale, -20.0f); };
    return -(bounded(s[0]) + bounded(s[1]) + bounded(s[2]) + LogSigmoid(logit));
  });
}

Buffer<uint32_t> WriteOrder(const CloudView& cloud, SplatOrder asked, SplatOrder of_format) {
  const SplatOrder order = asked == SplatOrder::kFormat ? of_format : asked;
  if (order == SplatOrder::kMorton) return MortonOrder(cloud);
  if (order == SplatOrder::kImportance) return ImportanceOrder(cloud);
  return {};
}

}  // namespace anchorsplat
