#include "core/kd_tree.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "core/parallel.h"

namespace anchorsplat {

namespace {

constexpr int64_t kLeaf = 8;  // points: fewer are searched faster than divided
constexpr int64_t kParallelRange = 1 << 15;

double SquaredDistance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  double sum = 0;
  for (size_t k = 0; k < 3; ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return sum;
}

}  // namespace

KdTree::KdTree(std::span<const float> positions) {
  const size_t n = positions.size() / 3;
  Buffer<Point> points(n);
  for (size_t i = 0; i < n; ++i) {
    for (size_t k = 0; k < 3; ++k) points[i][k] = positions[3 * i + k];
  }
  index_.resize(n);
  axis_.resize(n);
  std::iota(index_.begin(), index_.end(), int64_t{0});
  Build(points, 0, static_cast<int64_t>(n));
  points_.resize(n);
  for (size_t place = 0; place < n; ++place) points_[place] = points[static_cast<size_t>(index_[place])];
}

void KdTree::Build(std::span<const Point> points, int64_t begin, int64_t end) {
  if (end - begin <= kLeaf) return;
  const auto at = [&](int64_t place) -> const Point& {
    return points[static_cast<size_t>(index_[static_cast<size_t>(place)])];
  };
  Point low = at(begin), high = low;
  for (int64_t place = begin; place < end; ++place) {
    for (size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], at(place)[k]);
      high[k] = std::max(high[k], at(place)[k]);
    }
  }
  size_t widest = 0;
  for (size_t k = 1; k < 3; ++k) {
    if (high[k] - low[k] > high[widest] - low[widest]) widest = k;
  }
  const int64_t middle = (begin + end) / 2;
  std::nth_element(index_.begin() + begin, index_.begin() + middle, index_.begin() + end, [&](int64_t a, int64_t b) {
    return points[static_cast<size_t>(a)][widest] < points[static_cast<size_t>(b)][widest];
  });
  axis_[static_cast<size_t>(middle)] = static_cast<uint8_t>(widest);
  // The halves are disjoint, so which thread divides them makes no difference.
  const int64_t halves[2][2] = {{begin, middle}, {middle + 1, end}};
  const auto build = [&](int64_t first, int64_t last) {
    for (int64_t half = first; half < last; ++half) Build(points, halves[half][0], halves[half][1]);
  };
  end - begin > kParallelRange ? ParallelFor(0, 2, 1, build) : build(0, 2);
}

struct KdTree::Search {
  const KdTree& tree;
  int64_t self;
  const Point& point;
  std::span<Neighbour> nearest;  // rising distances, infinite where nothing was found yet

  double farthest() const { return nearest.back().squared_distance; }

  void Look(int64_t place) const {
    if (place == self) return;
    const double distance = SquaredDistance(tree.points_[static_cast<size_t>(place)], point);
    if (!(distance < farthest())) return;
    size_t k = nearest.size() - 1;
    for (; k > 0 && distance < nearest[k - 1].squared_distance; --k) nearest[k] = nearest[k - 1];
    nearest[k] = {distance, tree.PointAt(place)};
  }

  void Range(int64_t begin, int64_t end) const {
    if (end - begin <= kLeaf) {
      for (int64_t place = begin; place < end; ++place) Look(place);
      return;
    }
    const int64_t middle = (begin + end) / 2;
    const size_t axis = tree.axis_[static_cast<size_t>(middle)];
    const double side = point[axis] - tree.points_[static_cast<size_t>(middle)][axis];
    Look(middle);
    side < 0 ? Range(begin, middle) : Range(middle + 1, end);
    // At equality no closer point can be on the other side.
    if (side * side < farthest()) side < 0 ? Range(middle + 1, end) : Range(begin, middle);
  }
};

int64_t KdTree::Nearest(int64_t place, std::span<Neighbour> nearest) const {
  if (nearest.empty()) return 0;
  std::fill(nearest.begin(), nearest.end(), Neighbour{std::numeric_limits<double>::infinity(), -1});
  const Search search{*this, place, points_[static_cast<size_t>(place)], nearest};
  search.Range(0, size());
  return std::min(static_cast<int64_t>(nearest.size()), size() - 1);
}

}  // namespace anchorsplat
