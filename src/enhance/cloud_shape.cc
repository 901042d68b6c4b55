#include "enhance/cloud_shape.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include "core/buffer.h"
#include "core/ellipsoid.h"
#include "core/statistics.h"
#include "enhance/gaussian_regions.h"

namespace anchorsplat {

namespace {

constexpr double kLowest = 0.05, kHighest = 0.95;  // quantiles between which it lies: a few lie anywhere
constexpr double kPlanLowest = 0.02, kPlanHighest = 0.98;
constexpr size_t kCells = 16;
constexpr double kLeastOfCell = 0.1;

// Cells between the quantiles of either axis; those beyond count for the cells at the edge.
double Fill(const Buffer<float>& a, const Buffer<float>& b) {
  const auto cell_of = [](const Buffer<float>& along) {
    Buffer<float> values = along;
    const auto low = double{Quantile(values, kPlanLowest)}, high = double{Quantile(values, kPlanHighest)};
    return [low, width = high - low, &along](size_t i) {
      const double at = width > 0 ? (double{along[i]} - low) / width * double{kCells} : 0;
      return at > 0 ? static_cast<size_t>(std::min(at, double{kCells} - 1)) : 0;  // NaN, too
    };
  };
  const auto column = cell_of(a), row = cell_of(b);
  std::array<size_t, kCells * kCells> counts{};
  for (size_t i = 0; i < a.size(); ++i) ++counts[column(i) * kCells + row(i)];
  const double least = kLeastOfCell * static_cast<double>(a.size()) / double{kCells * kCells};
  const auto filled = std::ranges::count_if(counts, [&](size_t n) { return n > 0 && static_cast<double>(n) >= least; });
  return static_cast<double>(filled) / double{kCells * kCells};
}

double RoundnessOf(const GaussianCloud& cloud) {
  Buffer<float> ratios(static_cast<size_t>(cloud.size()));
  for (size_t i = 0; i < ratios.size(); ++i) {
    const auto [smallest, middle, largest] = AxesOf(cloud, i);
    ratios[i] = largest > 0 ? static_cast<float>(smallest / largest) : 0;
  }
  return double{Quantile(ratios, 0.5)};
}

}  // namespace

PrincipalPlaces AlongPrincipalAxes(const GaussianCloud& cloud) {
  const auto count = static_cast<size_t>(cloud.size());
  Buffer<float> values(count);
  std::array<double, 3> middle;
  for (size_t a = 0; a < 3; ++a) {
    for (size_t i = 0; i < count; ++i) values[i] = cloud.means[3 * i + a];
    middle[a] = double{Quantile(values, 0.5)};
  }
  const auto away = [&](size_t i) {
    return std::array<double, 3>{cloud.means[3 * i] - middle[0], cloud.means[3 * i + 1] - middle[1],
                                 cloud.means[3 * i + 2] - middle[2]};
  };
  Buffer<float> squared(count);
  for (size_t i = 0; i < count; ++i) {
    const auto [x, y, z] = away(i);
    squared[i] = static_cast<float>(x * x + y * y + z * z);
  }
  values = squared;
  const float farthest = Quantile(values, kHighest);
  std::array<double, 6> moments{};
  for (size_t i = 0; i < count; ++i) {
    if (squared[i] > farthest) continue;
    const auto [x, y, z] = away(i);
    const std::array<double, 6> products = {x * x, x * y, x * z, y * y, y * z, z * z};
    for (size_t k = 0; k < 6; ++k) moments[k] += products[k];
  }
  const Ellipsoid shape = EllipsoidOf(moments);
  std::array<Buffer<float>, 3> along;
  std::array<double, 3> sides;
  for (size_t k = 0; k < 3; ++k) {
    along[k].resize(count);
    for (size_t i = 0; i < count; ++i) {
      const auto at = away(i);
      along[k][i] = static_cast<float>(shape.axes[k] * at[0] + shape.axes[3 + k] * at[1] + shape.axes[6 + k] * at[2]);
    }
    values = along[k];
    const auto high = double{Quantile(values, kHighest)};
    sides[k] = high - double{Quantile(values, kLowest)};
  }
  std::array<size_t, 3> order = {0, 1, 2};
  std::ranges::sort(order, {}, [&](size_t k) { return sides[k]; });
  PrincipalPlaces places;
  for (size_t k = 0; k < 3; ++k) {
    const size_t from = order[k];
    places.along[k] = std::move(along[from]);
    places.sides[k] = sides[from];
    places.axes[k] = {shape.axes[from], shape.axes[3 + from], shape.axes[6 + from]};
  }
  return places;
}

CloudShape ShapeOf(const GaussianCloud& cloud) {
  if (cloud.empty()) return {};
  const PrincipalPlaces places = AlongPrincipalAxes(cloud);
  return {.flatness = places.sides[1] > 0 ? places.sides[0] / places.sides[1] : 1,
          .fill = Fill(places.along[1], places.along[2]),
          .roundness = RoundnessOf(cloud)};
}

}  // namespace anchorsplat
