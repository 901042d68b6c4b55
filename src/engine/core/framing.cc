#include "core/framing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "core/kd_tree.h"
#include "core/parallel.h"
#include "core/statistics.h"

namespace anchorsplat {

namespace {
constexpr float kVisibleLogit = -2.2f;  // opacity 10 %: haze around an object should not move the camera
// Larger clouds are subsampled: quantiles of half a million are off by at most a thousandth of the Gaussians.
constexpr int64_t kMostLookedAt = 1'000'000;

constexpr float kAnyLogit = -std::numeric_limits<float>::infinity();
constexpr float kLeastLogSize = -170;  // of two axes; gives points and needles a size

int64_t Stride(int64_t gaussians) { return std::max<int64_t>(1, (gaussians + kMostLookedAt - 1) / kMostLookedAt); }

// ---- finding the subject

constexpr size_t kFewest = 64;  // Gaussians; of fewer, all count
constexpr size_t kMostSearched = 10'000;
constexpr size_t kNeighbours = 8;
// Gaussians are floaters if farther from their neighbours than usual by this factor, in world units and relative to
// their own size.
constexpr double kLonely = 5;
constexpr double kGap = 3;        // ratio of distances from the middle, a hundredth of the Gaussians apart
constexpr double kBeyondGap = 4;  // ratio of the median distance beyond the gap to where the gap begins
constexpr double kFewDirections = 0.35;
constexpr double kWorthIt = 0.5;

using Rows = std::vector<uint32_t>;

double Distance(const float* p, const std::array<double, 3>& from) {
  return std::hypot(p[0] - from[0], p[1] - from[1], p[2] - from[2]);
}

std::array<double, 3> MedianOf(const Buffer<float>& means, const Rows& rows) {
  std::array<double, 3> middle{};
  Buffer<float> values(rows.size());
  for (size_t a = 0; a < 3; ++a) {
    for (size_t k = 0; k < rows.size(); ++k) values[k] = means[3 * rows[k] + a];
    middle[a] = Quantile(values, 0.5);
  }
  return middle;
}

// Drops floaters: Gaussians on a surface are about as large as their spacing, floaters are isolated.
Rows WithoutLonely(const Buffer<float>& means, const Buffer<float>& log_sizes, const Rows& rows) {
  Buffer<float> points;
  points.reserve(3 * rows.size());
  for (const uint32_t row : rows) points.insert(points.end(), means.data() + 3 * row, means.data() + 3 * row + 3);
  const KdTree tree(points);
  Buffer<float> apart(rows.size()), in_sizes(rows.size());  // logarithms
  ParallelFor(0, tree.size(), 1 << 10, [&](int64_t first, int64_t last) {
    std::array<KdTree::Neighbour, kNeighbours> nearest;
    for (int64_t place = first; place < last; ++place) {
      const auto found = static_cast<size_t>(tree.Nearest(place, nearest));
      const auto k = static_cast<size_t>(tree.PointAt(place));
      const double squared = nearest[found - 1].squared_distance;
      apart[k] = static_cast<float>(0.5 * std::log(std::max(squared, double{std::numeric_limits<float>::min()})));
      in_sizes[k] = apart[k] - log_sizes[rows[k]];
    }
  });
  const float margin = std::log(static_cast<float>(kLonely));
  Buffer<float> sorted = apart;
  const float most_apart = Quantile(sorted, 0.5) + margin;
  sorted = in_sizes;
  const float most_in_sizes = Quantile(sorted, 0.5) + margin;
  Rows kept;
  for (size_t k = 0; k < rows.size(); ++k) {
    if (!(apart[k] > most_apart && in_sizes[k] > most_in_sizes)) kept.push_back(rows[k]);
  }
  return kept;
}

// Whether `rows`, seen from `middle`, occupy few directions, as another object does and a sky does not: they hit few of
// the 96 cells of a cube's faces, compared with equally many points all around.
bool InFewDirections(const Buffer<float>& means, std::span<const uint32_t> rows, const std::array<double, 3>& middle) {
  constexpr int kSide = 4, kParts = 6 * kSide * kSide;
  std::array<bool, kParts> seen{};
  for (const uint32_t row : rows) {
    const float* p = means.data() + 3 * row;
    const std::array<double, 3> d = {p[0] - middle[0], p[1] - middle[1], p[2] - middle[2]};
    size_t face = 0;
    for (size_t a = 1; a < 3; ++a) face = std::abs(d[a]) > std::abs(d[face]) ? a : face;
    if (d[face] == 0) continue;
    const auto part = [&](size_t a) {
      return std::clamp(static_cast<int>((d[a] / std::abs(d[face]) + 1) / 2 * kSide), 0, kSide - 1);
    };
    const int side = static_cast<int>(2 * face) + (d[face] > 0 ? 1 : 0);
    seen[static_cast<size_t>((side * kSide + part((face + 1) % 3)) * kSide + part((face + 2) % 3))] = true;
  }
  const double all_around = kParts * (1 - std::exp(-static_cast<double>(rows.size()) / kParts));
  return static_cast<double>(std::ranges::count(seen, true)) < kFewDirections * all_around;
}

// Drops what lies beyond a gap, outermost first.
Rows WithinGaps(const Buffer<float>& means, Rows rows) {
  while (rows.size() >= kFewest) {
    const std::array<double, 3> middle = MedianOf(means, rows);
    std::ranges::sort(rows, {}, [&](uint32_t row) { return std::pair(Distance(means.data() + 3 * row, middle), row); });
    const auto distance = [&](size_t k) { return Distance(means.data() + 3 * rows[k], middle); };
    const size_t window = std::max<size_t>(1, rows.size() / 100), half = rows.size() / 2;
    size_t begin = rows.size() - window;  // one past the examined index
    while (begin > half && !(distance(begin - 1 + window) >= kGap * distance(begin - 1))) --begin;
    if (begin == half) return rows;
    // The widest step of the window.
    size_t end = begin;
    double widest = 0;
    for (size_t k = begin; k < begin + window; ++k) {
      const double step = distance(k) / distance(k - 1);  // infinite if many coincide with the middle
      if (step > widest) {
        widest = step;
        end = k;
      }
    }
    if (!(distance((end + rows.size()) / 2) >= kBeyondGap * distance(end - 1))) return rows;
    if (InFewDirections(means, std::span(rows).subspan(end), middle)) return rows;
    rows.resize(end);
  }
  return rows;
}

// Framing of the Gaussians at `rows`.
Framing FrameRows(const Buffer<float>& means, const Rows& rows, double reach) {
  Framing framing;
  if (rows.empty()) return framing;
  Buffer<float> values(rows.size());
  for (size_t a = 0; a < 3; ++a) {
    for (size_t k = 0; k < rows.size(); ++k) values[k] = means[3 * size_t{rows[k]} + a];
    const double low = Quantile(values, 0.01), high = Quantile(values, 0.99);
    framing.target[a] = 0.5 * (low + high);
    framing.half[a] = 0.5 * (high - low);
  }
  for (size_t k = 0; k < rows.size(); ++k) {
    const float* p = means.data() + 3 * size_t{rows[k]};
    double sum = 0;
    for (size_t a = 0; a < 3; ++a) sum += (p[a] - framing.target[a]) * (p[a] - framing.target[a]);
    values[k] = static_cast<float>(std::sqrt(sum));
  }
  const double radius = Quantile(values, 0.98);
  if (radius > 0 && std::isfinite(radius)) {
    framing.radius = radius;
  } else if (reach > 0) {
    framing.radius = reach;
  }
  return framing;
}

}  // namespace

Framing FrameMeans(const CloudView& cloud) {
  FramingStudy study(cloud.size());
  ParallelFor(0, cloud.size(), 1 << 16, [&](int64_t first, int64_t last) {
    const auto begin = static_cast<size_t>(first), count = static_cast<size_t>(last - first);
    CloudView rows;
    rows.means = cloud.means.subspan(3 * begin, 3 * count);
    rows.log_scales = cloud.log_scales.subspan(3 * begin, 3 * count);
    rows.quats = cloud.quats.subspan(4 * begin, 4 * count);
    rows.opacity_logits = cloud.opacity_logits.subspan(begin, count);
    study.Visit(first, rows);
  });
  return study.Find();
}

bool IsFarOut(const Framing& framing, const float* mean) {
  constexpr double kFarOut = 10;
  return Distance(mean, framing.target) > kFarOut * framing.radius;
}

Framing FrameCloud(const CloudView& cloud) {
  Framing framing = FrameMeans(cloud);
  for (size_t a = 0; a < 3; ++a) framing.target[a] += cloud.origin[a];
  return framing;
}

FramingStudy::FramingStudy(int64_t gaussians) : step_(Stride(gaussians)) {
  const auto looked_at = static_cast<size_t>((gaussians + step_ - 1) / step_);
  means_.resize(3 * looked_at);
  opacity_logits_.resize(looked_at);
  log_sizes_.resize(looked_at);
}

void FramingStudy::Visit(int64_t first, const CloudView& rows) {
  const int64_t next = (first + step_ - 1) / step_ * step_;
  for (int64_t i = next; i < first + rows.size(); i += step_) {
    const auto row = static_cast<size_t>(i - first), to = static_cast<size_t>(i / step_);
    std::copy_n(rows.means.data() + 3 * row, 3, means_.data() + 3 * to);
    const bool usable = HasUsableShape(rows, i - first);
    opacity_logits_[to] = usable ? rows.opacity_logits[row] : std::numeric_limits<float>::quiet_NaN();
    const float* s = rows.log_scales.data() + 3 * row;
    log_sizes_[to] = 0.5f * std::max({s[0] + s[1], s[0] + s[2], s[1] + s[2], kLeastLogSize});
  }
  // Of all rows only the longest matters, which saves exponentials.
  float any = kAnyLogit, visible = kAnyLogit;
  double reach = 0, visible_reach = 0;
  for (size_t k = 0; k < rows.log_scales.size(); ++k) {
    const float scale = rows.log_scales[k], logit = rows.opacity_logits[k / 3];
    if (!(scale > any || scale > visible) || !HasUsableShape(rows, static_cast<int64_t>(k / 3))) continue;
    const double here = 3 * std::exp(double{scale});
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
  const auto collect = [&](float least_logit) {
    Rows rows;
    for (uint32_t k = 0; k < opacity_logits_.size(); ++k) {
      if (opacity_logits_[k] >= least_logit) rows.push_back(k);
    }
    return rows;
  };
  Rows rows = collect(kVisibleLogit);
  double reach = visible_reach_;
  if (rows.empty()) {  // haze only: frame all of it
    rows = collect(kAnyLogit);
    reach = reach_;
  }
  const Framing whole = FrameRows(means_, rows, reach);
  if (rows.size() < kFewest) return whole;
  const size_t step = (rows.size() + kMostSearched - 1) / kMostSearched;
  Rows some;
  for (size_t k = 0; k < rows.size(); k += step) some.push_back(rows[k]);
  // If half of them already need this much room, nothing can be gained.
  const std::array<double, 3> middle = MedianOf(means_, some);
  Buffer<float> distances;
  for (const uint32_t row : some) {
    distances.push_back(static_cast<float>(Distance(means_.data() + 3 * size_t{row}, middle)));
  }
  if (kWorthIt * whole.radius < Quantile(distances, 0.5)) return whole;
  Rows neighbours = WithoutLonely(means_, log_sizes_, some);
  if (2 * neighbours.size() < some.size()) neighbours = std::move(some);
  const Framing subject = FrameRows(means_, WithinGaps(means_, std::move(neighbours)), reach);
  return subject.radius < kWorthIt * whole.radius ? subject : whole;
}

double FramingDistance(const Framing& framing, const Pinhole& intrinsics) {
  const double half = std::min(0.5 * intrinsics.width / intrinsics.fx, 0.5 * intrinsics.height / intrinsics.fy);
  return 1.1 * framing.radius / std::sin(std::atan(half));
}

}  // namespace anchorsplat
