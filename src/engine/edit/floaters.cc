#include "edit/floaters.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/kd_tree.h"
#include "core/parallel.h"
#include "core/statistics.h"

namespace anchorsplat {

namespace {

constexpr size_t kFourth = 4;
constexpr double kLeastApart = 3, kSpread = 1.6, kSpreadPower = 2.5, kLengths = 0.4, kLengthsPower = 0.6;
constexpr int64_t kPlacesPerTask = 4096;

// Quantile of the positive values; reorders them. Exact duplicates, of which broken files have thousands, say nothing
// about spacing.
double QuantileAboveZero(Buffer<float>& values, double q) {
  const auto end = std::partition(values.begin(), values.end(), [](float x) { return x > 0; });
  return double{Quantile(std::span(values).first(static_cast<size_t>(end - values.begin())), q)};
}

}  // namespace

Buffer<uint8_t> FindFloaters(std::span<const float> places, std::span<const float> lengths,
                             const FloaterOptions& options) {
  Buffer<uint8_t> floats(lengths.size());
  std::ranges::fill(floats, uint8_t{0});
  if (lengths.size() <= kFourth) return floats;
  Buffer<float> apart(lengths.size());
  {
    const KdTree tree(places);
    ParallelFor(0, tree.size(), kPlacesPerTask, [&](int64_t first, int64_t last) {
      std::array<KdTree::Neighbour, kFourth> nearest;
      for (int64_t place = first; place < last; ++place) {
        tree.NearestPlaces(place, nearest);
        apart[static_cast<size_t>(tree.PointAt(place))] =
            static_cast<float>(std::sqrt(nearest[kFourth - 1].squared_distance));
      }
    });
  }
  Buffer<float> values = apart;
  const double median = QuantileAboveZero(values, 0.5), quartile = QuantileAboveZero(values, 0.75);
  if (!(median > 0)) return floats;
  const auto ratio = [&](size_t i) { return apart[i] / lengths[i]; };  // ∞ for a point
  for (size_t i = 0; i < values.size(); ++i) values[i] = ratio(i);
  const double typical = QuantileAboveZero(values, 0.5);
  const double least = options.factor * std::max(kLeastApart, kSpread * std::pow(quartile / median, kSpreadPower));
  for (size_t i = 0; i < floats.size(); ++i) {
    const double d = apart[i] / median;
    const bool is_one = d > least && ratio(i) > kLengths * std::pow(d, kLengthsPower) * typical;
    floats[i] = is_one ? 1 : 0;
  }
  return floats;
}

}  // namespace anchorsplat
