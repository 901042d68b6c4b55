#include "core/kd_tree.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "core/parallel.h"

namespace anchorsplat {

namespace {

constexpr int64_t kLeaf = 8;  // points; splitting fewer does not pay
constexpr int64_t kParallelRange = 1 << 15;
constexpr size_t kInOrder = 96;  // up to this many neighbours a sorted list is faster

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

std::pair<int64_t, int64_t> KdTree::BoxAround(int64_t place, int64_t most) const {
  int64_t begin = 0, end = size();
  while (end - begin > std::max(most, kLeaf)) {
    const int64_t middle = (begin + end) / 2;
    place < middle ? end = middle : begin = middle + 1;
  }
  return {begin, end};
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

// Small result set, kept sorted by insertion.
class KdTree::Few {
 public:
  explicit Few(std::span<Neighbour> nearest) : nearest_(nearest) {
    std::ranges::fill(nearest_, Neighbour{std::numeric_limits<double>::infinity(), -1});
  }
  double farthest() const { return nearest_.back().squared_distance; }
  void Add(double distance, int64_t place) {
    size_t k = nearest_.size() - 1;
    for (; k > 0 && distance < nearest_[k - 1].squared_distance; --k) nearest_[k] = nearest_[k - 1];
    nearest_[k] = {distance, place};
  }
  void Finish() {}

 private:
  std::span<Neighbour> nearest_;  // increasing distances, infinite if unused
};

// Large result set: collects twice as many, then drops the farther half, at constant cost per point.
class KdTree::Many {
 public:
  explicit Many(std::span<Neighbour> nearest) : nearest_(nearest) { pile_.reserve(2 * nearest.size()); }
  double farthest() const { return farthest_; }
  void Add(double distance, int64_t place) {
    pile_.push_back({distance, place});
    if (pile_.size() == 2 * nearest_.size()) Drop();
  }
  void Finish() {
    if (pile_.size() > nearest_.size()) Drop();
    std::ranges::sort(pile_, IsNearer);
    std::ranges::copy(pile_, nearest_.begin());
  }

 private:
  static bool IsNearer(const Neighbour& a, const Neighbour& b) {
    return std::pair(a.squared_distance, a.index) < std::pair(b.squared_distance, b.index);
  }
  void Drop() {
    const auto last = pile_.begin() + static_cast<std::ptrdiff_t>(nearest_.size()) - 1;
    std::ranges::nth_element(pile_, last, IsNearer);
    farthest_ = last->squared_distance;
    pile_.resize(nearest_.size());
  }

  std::span<Neighbour> nearest_;
  std::vector<Neighbour> pile_;
  double farthest_ = std::numeric_limits<double>::infinity();
};

template <typename Found>
struct KdTree::Search {
  const KdTree& tree;
  int64_t self;
  std::array<double, 3> point;
  Found nearest;

  void Visit(int64_t place) {
    if (place == self) return;
    const double distance = SquaredDistance(tree.points_[static_cast<size_t>(place)].position, point);
    if (distance < nearest.farthest()) nearest.Add(distance, place);
  }

  void Range(int64_t begin, int64_t end) {
    if (end - begin <= kLeaf) {
      for (int64_t place = begin; place < end; ++place) Visit(place);
      return;
    }
    const int64_t middle = (begin + end) / 2;
    const size_t axis = tree.axis_[static_cast<size_t>(middle)];
    const double side = point[axis] - double{tree.points_[static_cast<size_t>(middle)].position[axis]};
    Visit(middle);
    side < 0 ? Range(begin, middle) : Range(middle + 1, end);
    // At equality no closer point can be on the other side.
    if (side * side < nearest.farthest()) side < 0 ? Range(middle + 1, end) : Range(begin, middle);
  }
};

int64_t KdTree::Find(const std::array<float, 3>& position, int64_t self, std::span<Neighbour> nearest) const {
  if (nearest.empty()) return 0;
  const auto search = [&]<typename Nearest>(Nearest keeps) {
    Search<Nearest> of{*this, self, {position[0], position[1], position[2]}, std::move(keeps)};
    of.Range(0, size());
    of.nearest.Finish();
  };
  nearest.size() <= kInOrder ? search(Few(nearest)) : search(Many(nearest));
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
