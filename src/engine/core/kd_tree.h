#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>

#include "core/buffer.h"

namespace anchorsplat {

// Exact nearest neighbours in 3-D by a balanced k-d tree. Not a grid: structure from motion and fits leave lone points
// far away, where a search in a grid would walk through empty cells.
//
// A *place* is a position in the tree's own order, 0 ≤ place < size(). Points at nearby places are close in space, so
// searching in order of places stays in the cache.
class KdTree {
 public:
  struct Neighbour {
    double squared_distance;
    int64_t index;
  };

  // `positions` [N,3], all finite.
  explicit KdTree(std::span<const float> positions);

  int64_t size() const { return static_cast<int64_t>(points_.size()); }

  // Index in `positions` of the point at `place`.
  int64_t PointAt(int64_t place) const { return points_[static_cast<size_t>(place)].index; }

  // Places [first, last) around `place` that fill an axis-aligned box of the tree; other points lie at most on its
  // faces. At most `most` places, or up to eight, as leaves are not divided.
  std::pair<int64_t, int64_t> BoxAround(int64_t place, int64_t most) const;

  // Finds the nearest.size() points closest to the point at `place`, itself excluded, by increasing distance. Returns
  // the number found, which is smaller if the tree has fewer points. Ties depend only on the order of `positions`.
  // Coincident points cost no more than others.
  int64_t Nearest(int64_t place, std::span<Neighbour> nearest) const;
  // The same around any finite position; a point exactly there is included.
  int64_t NearestTo(const std::array<float, 3>& position, std::span<Neighbour> nearest) const;
  // Nearest(), with places instead of indices in the result.
  int64_t NearestPlaces(int64_t place, std::span<Neighbour> nearest) const;

 private:
  struct Point {
    std::array<float, 3> position;
    int64_t index;
  };
  class Few;
  class Many;
  template <typename Found>
  struct Search;

  void Build(int64_t begin, int64_t end);
  int64_t Find(const std::array<float, 3>& position, int64_t self, std::span<Neighbour> nearest) const;
  void PlacesToIndices(std::span<Neighbour> nearest) const;

  // In tree order: the middle of each range splits it along its widest axis, stored in `axis_` at the middle.
  Buffer<Point> points_;
  Buffer<uint8_t> axis_;
};

}  // namespace anchorsplat
