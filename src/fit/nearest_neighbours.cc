#include "fit/nearest_neighbours.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

#include "core/parallel.h"

namespace anchorsplat {

namespace {

constexpr size_t kNeighbours = 3;
constexpr int64_t kLeaf = 8;  // points: fewer are searched faster than divided

using Point = std::array<double, 3>;

double SquaredDistance(const Point& a, const Point& b) {
  double sum = 0;
  for (size_t k = 0; k < 3; ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return sum;
}

// A balanced tree without nodes: `order` holds the points such that the middle of every range divides it along its
// widest side, which `axis` keeps at that place.
class KdTree {
 public:
  explicit KdTree(std::vector<Point> points)
      : points_(std::move(points)), order_(points_.size()), axis_(points_.size()) {
    std::iota(order_.begin(), order_.end(), int64_t{0});
    Build(0, static_cast<int64_t>(points_.size()));
  }

  // Squared distances to the nearest others of point i, ascending; infinite where there are too few.
  std::array<double, kNeighbours> Nearest(int64_t i) const {
    std::array<double, kNeighbours> best;
    best.fill(std::numeric_limits<double>::infinity());
    Search(0, static_cast<int64_t>(points_.size()), i, best);
    return best;
  }

 private:
  const Point& at(int64_t place) const { return points_[static_cast<size_t>(order_[static_cast<size_t>(place)])]; }

  void Build(int64_t begin, int64_t end) {
    if (end - begin <= kLeaf) return;
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
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end, [&](int64_t a, int64_t b) {
      return points_[static_cast<size_t>(a)][widest] < points_[static_cast<size_t>(b)][widest];
    });
    axis_[static_cast<size_t>(middle)] = static_cast<uint8_t>(widest);
    Build(begin, middle);
    Build(middle + 1, end);
  }

  void Look(int64_t place, int64_t i, std::array<double, kNeighbours>& best) const {
    if (order_[static_cast<size_t>(place)] == i) return;
    const double distance = SquaredDistance(at(place), points_[static_cast<size_t>(i)]);
    if (!(distance < best.back())) return;
    best.back() = distance;
    for (size_t k = kNeighbours - 1; k > 0 && best[k] < best[k - 1]; --k) std::swap(best[k], best[k - 1]);
  }

  void Search(int64_t begin, int64_t end, int64_t i, std::array<double, kNeighbours>& best) const {
    if (end - begin <= kLeaf) {
      for (int64_t place = begin; place < end; ++place) Look(place, i, best);
      return;
    }
    const int64_t middle = (begin + end) / 2;
    const size_t axis = axis_[static_cast<size_t>(middle)];
    const double side = points_[static_cast<size_t>(i)][axis] - at(middle)[axis];
    Look(middle, i, best);
    side < 0 ? Search(begin, middle, i, best) : Search(middle + 1, end, i, best);
    // At equality no closer point can be on the other side.
    if (side * side < best.back()) side < 0 ? Search(middle + 1, end, i, best) : Search(begin, middle, i, best);
  }

  std::vector<Point> points_;
  std::vector<int64_t> order_;
  std::vector<uint8_t> axis_;
};

}  // namespace

Buffer<float> MeanSquaredNeighbourDistance(std::span<const float> positions) {
  const auto n = static_cast<int64_t>(positions.size() / 3);
  std::vector<Point> points(static_cast<size_t>(n));
  for (size_t i = 0; i < points.size(); ++i) {
    for (size_t k = 0; k < 3; ++k) points[i][k] = positions[3 * i + k];
  }
  const KdTree tree(std::move(points));
  Buffer<float> out(static_cast<size_t>(n));
  const auto others = static_cast<size_t>(std::min<int64_t>(kNeighbours, std::max<int64_t>(0, n - 1)));
  ParallelFor(0, n, 1024, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const auto nearest = tree.Nearest(i);
      const double sum = std::accumulate(nearest.begin(), nearest.begin() + static_cast<ptrdiff_t>(others), 0.0);
      out[static_cast<size_t>(i)] = others == 0 ? 0.0f : static_cast<float>(sum / static_cast<double>(others));
    }
  });
  return out;
}

}  // namespace anchorsplat
