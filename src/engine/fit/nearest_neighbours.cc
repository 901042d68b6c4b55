#include "fit/nearest_neighbours.h"

#include <array>
#include <cstdint>

#include "core/kd_tree.h"
#include "core/parallel.h"

namespace anchorsplat {

Buffer<float> MeanSquaredNeighbourDistance(std::span<const float> positions) {
  const KdTree tree(positions);
  Buffer<float> out(static_cast<size_t>(tree.size()));
  ParallelFor(0, tree.size(), 1024, [&](int64_t begin, int64_t end) {
    for (int64_t place = begin; place < end; ++place) {
      std::array<KdTree::Neighbour, 3> nearest;
      const int64_t found = tree.Nearest(place, nearest);
      double sum = 0;
      for (int64_t k = 0; k < found; ++k) sum += nearest[static_cast<size_t>(k)].squared_distance;
      out[static_cast<size_t>(tree.PointAt(place))] =
          found == 0 ? 0.0f : static_cast<float>(sum / static_cast<double>(found));
    }
  });
  return out;
}

}  // namespace anchorsplat
