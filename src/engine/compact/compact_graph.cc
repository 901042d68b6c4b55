#include "compact/compact_graph.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/kd_tree.h"
#include "core/parallel.h"
#include "core/rotation.h"
#include "kernels/serialization.h"

namespace anchorsplat {

namespace {

// Computes the frame of Gaussian i from its neighbours.
void FindFrame(const GaussianCloud& cloud, int64_t i, CompactGraph& graph) {
  const float* q = cloud.quats.data() + 4 * i;
  const float* scales = cloud.log_scales.data() + 3 * i;
  const auto rotation = RotationFromQuaternion<double>(q[0], q[1], q[2], q[3]);
  uint8_t* stored = graph.stored_axis.data() + 3 * i;
  for (uint8_t a = 0; a < 3; ++a) stored[a] = a;
  std::stable_sort(stored, stored + 3, [&](uint8_t a, uint8_t b) { return scales[a] > scales[b]; });

  std::array<double, 3> sum = {0, 0, 0};  // of unit vectors to the neighbours
  for (int64_t k = 0; k < graph.neighbours; ++k) {
    const float* from = cloud.means.data() + 3 * i;
    const float* to = cloud.means.data() + int64_t{3} * graph.index[static_cast<size_t>(i * graph.neighbours + k)];
    std::array<double, 3> d;
    double square = 0;
    for (size_t c = 0; c < 3; ++c) {
      d[c] = double{to[c]} - from[c];
      square += d[c] * d[c];
    }
    if (!(square > 0)) continue;
    for (size_t c = 0; c < 3; ++c) sum[c] += d[c] / std::sqrt(square);
  }
  for (size_t a = 0; a < 3; ++a) {
    double along = 0;
    for (size_t c = 0; c < 3; ++c) along += rotation[3 * c + stored[a]] * sum[c];
    const double sign = along < 0 ? -1 : 1;
    for (size_t c = 0; c < 3; ++c) {
      graph.axes[static_cast<size_t>(9 * i) + 3 * a + c] = static_cast<float>(sign * rotation[3 * c + stored[a]]);
    }
    graph.sidedness[static_cast<size_t>(3 * i) + a] =
        static_cast<float>(std::abs(along) / static_cast<double>(std::max<int64_t>(1, graph.neighbours)));
  }
}

void FindFrames(const GaussianCloud& cloud, CompactGraph& graph) {
  graph.axes.resize(static_cast<size_t>(9 * graph.count));
  graph.stored_axis.resize(static_cast<size_t>(3 * graph.count));
  graph.sidedness.resize(static_cast<size_t>(3 * graph.count));
  ParallelFor(0, graph.count, 512, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) FindFrame(cloud, i, graph);
  });
}

void FindNearest(const GaussianCloud& cloud, CompactNeighbours& near) {
  const KdTree tree(cloud.means);
  for (int64_t place = 0; place < tree.size(); ++place) {
    near.rows[static_cast<size_t>(place)] = static_cast<int32_t>(tree.PointAt(place));
  }
  ParallelFor(0, tree.size(), 512, [&](int64_t begin, int64_t end) {
    std::vector<KdTree::Neighbour> nearest(static_cast<size_t>(near.neighbours));
    for (int64_t place = begin; place < end; ++place) {
      tree.NearestPlaces(place, nearest);
      int32_t* out = near.index.data() + place * near.neighbours;
      for (const KdTree::Neighbour& neighbour : nearest) *out++ = static_cast<int32_t>(neighbour.index);
    }
  });
}

// Patches along the Hilbert curve through the cloud's box. A last patch that is not full borrows preceding Gaussians.
void FindPatches(const GaussianCloud& cloud, CompactNeighbours& near) {
  const int64_t n = cloud.size(), m = near.neighbours;
  if (n == 0) return;
  const Bounds box = *ComputeBounds(cloud);
  double side = 0;
  for (size_t c = 0; c < 3; ++c) side = std::max(side, double{box.max[c]} - box.min[c]);
  Buffer<int32_t> voxels(static_cast<size_t>(3 * n), 0);
  if (side > 0) {
    constexpr double kLargest = (1 << kMaxCurveDepth) - 1;
    for (size_t k = 0; k < voxels.size(); ++k) {
      voxels[k] = static_cast<int32_t>((double{cloud.means[k]} - box.min[k % 3]) / side * kLargest);
    }
  }
  Buffer<int64_t> codes(static_cast<size_t>(n));
  CurveCodes(Curve::kHilbert, kMaxCurveDepth, voxels, codes);
  near.rows = OrderOfCodes(codes);
  ParallelFor(0, n, 512, [&](int64_t begin, int64_t end) {
    struct Other {
      double square;
      int32_t row;
      int64_t place;
    };
    std::vector<Other> others;
    for (int64_t place = begin; place < end; ++place) {
      const int64_t first = std::min(place / (m + 1) * (m + 1), n - (m + 1));
      const int32_t i = near.rows[static_cast<size_t>(place)];
      others.clear();
      for (int64_t other = first; other <= first + m; ++other) {
        if (other == place) continue;
        const int32_t j = near.rows[static_cast<size_t>(other)];
        double square = 0;
        for (int64_t c = 0; c < 3; ++c) {
          const double d = double{cloud.means[static_cast<size_t>(3 * int64_t{j} + c)]} -
                           cloud.means[static_cast<size_t>(3 * int64_t{i} + c)];
          square += d * d;
        }
        others.push_back({square, j, other});
      }
      std::ranges::sort(others, {}, [](const Other& o) { return std::pair(o.square, o.row); });
      for (int64_t k = 0; k < m; ++k) {
        near.index[static_cast<size_t>(place * m + k)] = static_cast<int32_t>(others[static_cast<size_t>(k)].place);
      }
    }
  });
}

}  // namespace

CompactNeighbours FindCompactNeighbours(const GaussianCloud& cloud, int64_t neighbours, CompactContext context) {
  CompactNeighbours near;
  const int64_t n = cloud.size();
  near.neighbours = std::clamp<int64_t>(n - 1, 0, neighbours);
  near.rows.resize(static_cast<size_t>(n));
  near.index.resize(static_cast<size_t>(n * near.neighbours));
  context == CompactContext::kPatches ? FindPatches(cloud, near) : FindNearest(cloud, near);
  return near;
}

CompactGraph BuildCompactGraph(const GaussianCloud& cloud, int64_t neighbours, CompactContext context) {
  const CompactNeighbours near = FindCompactNeighbours(cloud, neighbours, context);
  const int64_t m = near.neighbours;
  Buffer<int32_t> index(near.index.size());
  for (int64_t place = 0; place < cloud.size(); ++place) {
    const int32_t* from = near.index.data() + place * m;
    int32_t* out = index.data() + near.rows[static_cast<size_t>(place)] * m;
    for (int64_t k = 0; k < m; ++k) out[k] = near.rows[static_cast<size_t>(from[k])];
  }
  return GraphOfNeighbours(cloud, m, std::move(index));
}

CompactGraph GraphOfNeighbours(const GaussianCloud& cloud, int64_t neighbours, Buffer<int32_t> index) {
  CompactGraph graph;
  graph.count = cloud.size();
  graph.neighbours = neighbours;
  graph.index = std::move(index);
  FindFrames(cloud, graph);
  return graph;
}

}  // namespace anchorsplat
