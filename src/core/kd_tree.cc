#include "core/kd_tree.h"

#include <algorithm>
#include <limits>

#include "core/parallel.h"

namespace anchorsplat {

namespace {

constexpr int64_t kLeaf = 8;  // points: fewer are searched faster than divided
constexpr int64_t kParallelRange = 1 << 15;

double SquaredDistance(const std::array<float, 3>& a, const std::array<double, 3>& b) {
  double sum = 0;
  for (size_t k = 0; k < 3; ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return sum;
}

}  // namespace

KdTree::KdTree(std::span<const float> positions) : points_(positions.size() / 3), axis_(positions.size() / 3) {
  for (size_t i = 0; i < points_.size(); ++i) {
    points_[i] = {{positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]}, static_cast<int64_t>(i)};
  }
  Build(0, size());
}

void KdTree::Build(int64_t begin, int64_t end) {
  if (end - begin <= kLeaf) return;
  std::array<float, 3> low = points_[static_cast<size_t>(begin)].position, high = low;
  for (int64_t place = begin; place < end; ++place) {
    const std::array<float, 3>& at = points_[static_cast<size_t>(place)].position;
    for (size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], at[k]);
      high[k] = std::max(high[k], at[k]);
    }
  }
  size_t widest = 0;
  const auto side = [&](size_t k) { return double{high[k]} - low[k]; };
  for (size_t k = 1; k < 3; ++k) {
    if (side(k) > side(widest)) widest = k;
  }
  const int64_t middle = (begin + end) / 2;
  std::nth_element(points_.begin() + begin, points_.begin() + middle, points_.begin() + end,
                   [&](const Point& a, const Point& b) { return a.position[widest] < b.position[widest]; });
  axis_[static_cast<size_t>(middle)] = static_cast<uint8_t>(widest);
  // The halves are disjoint, so which thread divides them makes no difference.
  const int64_t halves[2][2] = {{begin, middle}, {middle + 1, end}};
  const auto build = [&](int64_t first, int64_t last) {
    for (int64_t half = first; half < last; ++half) Build(halves[half][0], halves[half][1]);
  };
  end - begin > kParallelRange ? ParallelFor(0, 2, 1, build) : build(0, 2);
}

struct KdTree::Search {
  const KdTree& tree;
  int64_t self;
  std::array<double, 3> point;
  std::span<Neighbour> nearest;  // rising distances, infinite where nothing was found yet

  double farthest() const { return nearest.back().squared_distance; }

  void Look(int64_t place) const {
    if (place == self) return;
    const double distance = SquaredDistance(tree.points_[static_cast<size_t>(place)].position, point);
    if (!(distance < farthest())) return;
    size_t k = nearest.size() - 1;
    for (; k > 0 && distance < nearest[k - 1].squared_distance; --k) nearest[k] = nearest[k - 1];
    nearest[k] = {distance, place};
  }

  void Range(int64_t begin, int64_t end) const {
    if (end - begin <= kLeaf) {
      for (int64_t place = begin; place < end; ++place) Look(place);
      return;
    }
    const int64_t middle = (begin + end) / 2;
    const size_t axis = tree.axis_[static_cast<size_t>(middle)];
    const double side = point[axis] - double{tree.points_[static_cast<size_t>(middle)].position[axis]};
    Look(middle);
    side < 0 ? Range(begin, middle) : Range(middle + 1, end);
    // At equality no closer point can be on the other side.
    if (side * side < farthest()) side < 0 ? Range(middle + 1, end) : Range(begin, middle);
  }
};

int64_t KdTree::Find(const std::array<float, 3>& position, int64_t self, std::span<Neighbour> nearest) const {
  if (nearest.empty()) return 0;
  std::fill(nearest.begin(), nearest.end(), Neighbour{std::numeric_limits<double>::infinity(), -1});
  const Search search{*this, self, {position[0], position[1], position[2]}, nearest};
  search.Range(0, size());
  return std::min(static_cast<int64_t>(nearest.size()), self < 0 ? size() : size() - 1);
}

void KdTree::PlacesToIndices(std::span<Neighbour> nearest) const {
  for (Neighbour& neighbour : nearest) neighbour.index = PointAt(neighbour.index);
}

int64_t KdTree::NearestPlaces(int64_t place, std::span<Neighbour> nearest) const {
  return Find(points_[static_cast<size_t>(place)].position, place, nearest);
}

int64_t KdTree::Nearest(int64_t place, std::span<Neighbour> nearest) const {
  const int64_t found = NearestPlaces(place, nearest);
  PlacesToIndices(nearest.first(static_cast<size_t>(found)));
  return found;
}

int64_t KdTree::NearestTo(const std::array<float, 3>& position, std::span<Neighbour> nearest) const {
  const int64_t found = Find(position, -1, nearest);
  PlacesToIndices(nearest.first(static_cast<size_t>(found)));
  return found;
}

}  // namespace anchorsplat
