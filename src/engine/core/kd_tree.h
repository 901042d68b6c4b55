#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>

#include "core/buffer.h"

namespace anchorsplat {

// Exact nearest neighbours of points in space by a balanced k-d tree. A tree and not a grid: structure-from-motion and
// fits leave lone points far away, where a grid would walk through empty cells.
class KdTree {
 public:
  struct Neighbour {
    double squared_distance;
    int64_t index;
  };

  // Positions [N,3], all finite.
  explicit KdTree(std::span<const float> positions);

  int64_t size() const { return static_cast<int64_t>(points_.size()); }

  // The point at a place of the tree, 0 ≤ place < size(). Points whose places are close lie close together, so that
  // searches in this order find what they need in the cache.
  int64_t PointAt(int64_t place) const { return points_[static_cast<size_t>(place)].index; }

  // Places [first, last) around `place` whose points a box holds that no others are in, but on its sides: at most
  // `most` of them, or eight, which are not divided.
  std::pair<int64_t, int64_t> BoxAround(int64_t place, int64_t most) const;

  // The points nearest to that at `place`, without itself, by rising distance, as many as fit into `nearest`. Returns
  // how many there are: fewer than asked for when the tree has no more. Which of several equally far ones are taken
  // depends on the order of the positions alone, and many points at one place cost no more than others.
  int64_t Nearest(int64_t place, std::span<Neighbour> nearest) const;
  // The same around any position, finite; a point that lies there is one of them.
  int64_t NearestTo(const std::array<float, 3>& position, std::span<Neighbour> nearest) const;
  // The first with the points' places in the place of their indices.
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

  // In the order of the tree: the middle of every range divides it along its widest side, which `axis_` keeps there.
  Buffer<Point> points_;
  Buffer<uint8_t> axis_;
};

}  // namespace anchorsplat
