#include "core/stored_values.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/finite.h"
#include "core/kd_tree.h"
#include "core/statistics.h"

namespace anchorsplat {

namespace {

constexpr size_t kFewestRows = 100;  // fewer tell nothing
constexpr double kNearlyAll = 0.99;

double ShareBelow(const std::vector<float>& values, float bound) {
  return static_cast<double>(std::ranges::count_if(values, [bound](float x) { return x < bound; })) /
         static_cast<double>(std::max<size_t>(1, values.size()));
}

}  // namespace

void StoredSample::Add(const CloudView& rows, int64_t row) {
  const auto i = static_cast<size_t>(row);
  // Lengths misread as logarithms may exceed kMaxLogScale.
  const auto is_scale = [](float x) { return !std::isnan(x) && x < std::numeric_limits<float>::infinity(); };
  const float* const stored = rows.log_scales.data() + 3 * row;
  if (!AllFinite(rows.means.data() + 3 * row, 3) || !std::all_of(stored, stored + 3, is_scale) ||
      std::isnan(rows.opacity_logits[i])) {
    return;
  }
  for (size_t k = 3 * i; k < 3 * i + 3; ++k) {
    means.push_back(rows.means[k]);
    scales.push_back(rows.log_scales[k]);
  }
  const float* const dc = rows.sh.data() + row * rows.sh_stride();
  colors.insert(colors.end(), dc, dc + 3);
  opacities.push_back(rows.opacity_logits[i]);
}

StoredSample SampleStored(const CloudView& cloud) {
  StoredSample sample;
  sample.total = cloud.size();
  for (int64_t i = 0; i < cloud.size(); i += StoredSample::Stride(cloud.size())) {
    sample.Add(cloud, i);
  }
  return sample;
}

bool LooksLikeLengths(const StoredSample& sample) {
  const size_t n = sample.opacities.size();
  if (n == 0) return false;
  std::vector<float> largest, smallest;
  std::array<float, 3> min = {sample.means[0], sample.means[1], sample.means[2]}, max = min;
  for (size_t i = 0; i < n; ++i) {
    const float* const s = sample.scales.data() + 3 * i;
    largest.push_back(std::max({s[0], s[1], s[2]}));
    smallest.push_back(std::min({s[0], s[1], s[2]}));
    for (size_t a = 0; a < 3; ++a) {
      min[a] = std::min(min[a], sample.means[3 * i + a]);
      max[a] = std::max(max[a], sample.means[3 * i + a]);
    }
  }
  if (ShareBelow(smallest, 0) > 1 - kNearlyAll) return false;
  const float extent = std::max({max[0] - min[0], max[1] - min[1], max[2] - min[2]});
  std::vector<float> sorted = largest;
  const float median = Quantile(sorted, 0.5);
  // As logarithms, half of the Gaussians would be longer than the splat.
  if (std::exp(median) > extent && extent > 0) return true;
  if (n < kFewestRows) return false;

  // At least a quarter of the shortest axes lie just above zero and vary there: logarithms would continue below zero.
  sorted = smallest;
  std::erase_if(sorted, [](float x) { return !(x > 0); });  // flat Gaussians tell nothing
  constexpr float kJustAbove = 0.2f, kUnlike = 1.2f;
  if (4 * sorted.size() > n) {
    const float lowest = Quantile(sorted, 0.05), quarter = Quantile(sorted, 0.25);
    if (quarter <= kJustAbove && quarter > kUnlike * lowest) return true;
  }

  // Compare with the distance to the nearest neighbour. Subsampling a surface by n increases it by √n.
  const KdTree tree(sample.means);
  const double thinned = std::sqrt(static_cast<double>(n) / static_cast<double>(std::max<int64_t>(sample.total, 1)));
  std::vector<float> as_logarithms, as_lengths;
  for (int64_t place = 0; place < tree.size(); ++place) {
    KdTree::Neighbour next;
    if (tree.Nearest(place, std::span(&next, 1)) == 0) continue;
    const double way = std::sqrt(next.squared_distance) * thinned;
    const float length = largest[static_cast<size_t>(tree.PointAt(place))];
    if (!(way > 1e-9 * double{extent}) || !(length > 0)) continue;  // duplicates coincide
    as_logarithms.push_back(static_cast<float>(double{length} - std::log(way)));
    as_lengths.push_back(static_cast<float>(std::log(double{length} / way)));
  }
  if (2 * as_lengths.size() < n) return false;
  // In 18 inspected splats of the field, half of the Gaussians are 1 to 7 times as long as the distance to their
  // neighbour.
  constexpr double kShort = 0.2, kLong = 25;
  sorted = largest;
  // All from 1 to 1.6 units long: more uniform than almost any splat.
  const bool alike = Quantile(sorted, 0.99) < 0.5f;
  const float logarithm = Quantile(as_logarithms, 0.5), length = Quantile(as_lengths, 0.5);
  return logarithm > std::log(alike ? 8.0 : 30.0) && length > std::log(kShort) && length < std::log(kLong);
}

bool LooksLikeOpacities(const StoredSample& sample) {
  const auto is_unit = [](float x) { return x >= 0 && x <= 1; };
  const auto n = static_cast<double>(sample.opacities.size());
  return sample.opacities.size() >= kFewestRows &&
         static_cast<double>(std::ranges::count_if(sample.opacities, is_unit)) > kNearlyAll * n;
}

int LooksLikeColors(const StoredSample& sample) {
  if (sample.opacities.size() < kFewestRows) return 0;
  const auto [low, high] = std::ranges::minmax(sample.colors);
  if (!(low >= 0)) return 0;
  std::vector<float> sorted(sample.colors.begin(), sample.colors.end());
  // As harmonics these would be light greys only, never beyond 0–1.
  constexpr float kWide = 0.6f;
  if (high <= 1) return Quantile(sorted, 0.99) - Quantile(sorted, 0.01) > kWide ? 1 : 0;
  // White is 1.8; an average of 10 is brighter than any light.
  return high <= 255 && Quantile(sorted, 0.5) > 10 ? 255 : 0;
}

}  // namespace anchorsplat
