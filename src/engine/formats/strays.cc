#include "formats/strays.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <vector>

#include "core/activations.h"
#include "core/statistics.h"
#include "formats/write_losses.h"

namespace anchorsplat {

namespace {

double ReachOf(const CloudView& cloud, int64_t row) {
  const float* p = cloud.means.data() + 3 * row;
  return double{std::max({std::fabs(p[0]), std::fabs(p[1]), std::fabs(p[2])})};
}

// Visible weight by size in units of the grain, in powers of two.
class SeenBySize {
 public:
  void Add(double size, double weight) {
    const int exponent = size > 0 ? std::ilogb(size) : -kHalf;
    weights_[static_cast<size_t>(std::clamp(exponent + kHalf, 0, 2 * kHalf - 1))] += weight;
    total_ += weight;
  }
  double Loss(double step) const {
    double loss = 0;
    for (size_t k = 0; k < weights_.size(); ++k) {
      if (weights_[k] > 0) loss += weights_[k] * RoundingLoss(step, std::ldexp(1.5, static_cast<int>(k) - kHalf));
    }
    return loss;
  }
  double total() const { return total_; }

 private:
  static constexpr int kHalf = 128;
  std::array<double, 2 * kHalf> weights_{};
  double total_ = 0;
};

struct FarRow {
  double reach, weight;
  int64_t row;
};

}  // namespace

double SizeOf(const CloudView& cloud, int64_t row) {
  const float* s = cloud.log_scales.data() + 3 * row;
  return std::exp(0.5 * std::max({double{s[0]} + s[1], double{s[0]} + s[2], double{s[1]} + s[2]}));
}

double VisibleWeight(const CloudView& cloud, int64_t row, const Framing& framing) {
  if (!IsDrawn(cloud, row)) return 0;
  const float* p = cloud.means.data() + 3 * row;
  const double away = std::hypot(p[0] - framing.target[0], p[1] - framing.target[1], p[2] - framing.target[2]);
  const double across = SizeOf(cloud, row) / std::hypot(away, framing.radius);
  return Sigmoid(double{cloud.opacity_logits[static_cast<size_t>(row)]}) * std::min(1.0, across * across);
}

double RoundingLoss(double step, double size) {
  const double off = step / size;  // half a step relative to half a size
  return off < 1 ? off * off : 1;  // also 1 for a point
}

std::optional<Framing> FramingWithFarOut(const CloudView& cloud) {
  const std::optional<Bounds> bounds = ComputeBounds(cloud);
  if (!bounds) return std::nullopt;
  double widest = 0;
  for (size_t a = 0; a < 3; ++a) widest = std::max(widest, double{bounds->max[a]} - double{bounds->min[a]});
  // Ten radii of half of them reach that far.
  constexpr double kNearEnough = 10;
  if (widest <= kNearEnough * double{FindMiddleOfMeans(cloud, 0.5).extent}) return std::nullopt;
  return FrameMeans(cloud);
}

Strays ChooseStrays(const CloudView& cloud, const std::function<double(double)>& step,
                    const std::function<double(double)>& grain) {
  Strays strays;
  const std::optional<Framing> framing = FramingWithFarOut(cloud);
  if (!framing) return strays;
  std::vector<FarRow> far;
  SeenBySize seen;
  double rest = 0;  // reach of the near ones
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (!HasUsableShape(cloud, i)) continue;
    const double weight = VisibleWeight(cloud, i, *framing), reach = ReachOf(cloud, i);
    seen.Add(SizeOf(cloud, i) / grain(reach), weight);
    if (IsFarOut(*framing, cloud.means.data() + 3 * i)) {
      far.push_back({reach, weight, i});
    } else {
      rest = std::max(rest, reach);
    }
  }
  std::ranges::sort(
      far, [](const FarRow& a, const FarRow& b) { return std::tie(a.reach, b.row) > std::tie(b.reach, a.row); });
  size_t best = 0;
  double least = std::numeric_limits<double>::infinity(), given_up = 0, last = least;
  for (size_t k = 0; k <= far.size(); ++k) {
    const double finest = step(k < far.size() ? std::max(far[k].reach, rest) : rest);
    if (finest < 0.9 * last || k == far.size()) {
      last = finest;
      const double loss = seen.Loss(finest) + given_up;
      if (k == 0 && loss <= kVisibleLoss * seen.total()) return strays;
      if (loss < least) {
        least = loss;
        best = k;
      }
    }
    if (k < far.size()) given_up += far[k].weight;
  }
  for (size_t k = 0; k < best; ++k) {
    const float* p = cloud.means.data() + 3 * far[k].row;
    strays.rows.push_back(far[k].row);
    strays.farthest = std::max(
        strays.farthest, std::hypot(p[0] - framing->target[0], p[1] - framing->target[1], p[2] - framing->target[2]));
  }
  std::ranges::sort(strays.rows);
  return strays;
}

}  // namespace anchorsplat
