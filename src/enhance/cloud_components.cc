#include "enhance/cloud_components.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <vector>

#include "core/kd_tree.h"
#include "core/parallel.h"
#include "core/run_context.h"
#include "core/statistics.h"
#include "enhance/showing_gaussians.h"

namespace anchorsplat {

namespace {

constexpr int64_t kComponentSample = 16'384;
// Neighbours are joined that are among so many nearest ones of either, no further apart than so many times the distance
// from either to its fourth, where that distance is much the same: a floater is far from a surface by the surface's own
// measure, and a chain of floaters begins with few close ones. Two spheres of 5,000 stay two with 300 floaters among
// them, and become one with 1,000. The largest piece of fits and captures is nine tenths and more of them, the next
// a hundredth at most; with a reach of 2 it is six tenths and three.
constexpr size_t kJoined = 12, kTypical = 4;
constexpr double kReach = 3, kMuchTheSame = 2;
// Things of fewer Gaussians that show are pieces of others, as wheels are: so few say nothing about pixels.
constexpr int64_t kLeastShowing = 1000;
constexpr double kLeastOfThing = 0.005;  // and of fewer of the sample than that: its graph has gaps
constexpr int64_t kComponentRowsPerTask = 16'384;

// Disjoint sets; the root of each is its first member.
class DisjointSets {
 public:
  explicit DisjointSets(int64_t size) : up_(static_cast<size_t>(size)) { std::iota(up_.begin(), up_.end(), size_t{0}); }

  size_t Root(size_t i) {
    while (up_[i] != i) i = up_[i] = up_[up_[i]];
    return i;
  }
  void Join(size_t a, size_t b) {
    a = Root(a), b = Root(b);
    up_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<size_t> up_;
};

DisjointSets JoinNeighbours(const Buffer<float>& places) {
  const KdTree tree(places);
  std::vector<std::array<KdTree::Neighbour, kJoined>> nearest(static_cast<size_t>(tree.size()));
  Buffer<double> typical(nearest.size());  // squared distances
  ParallelFor(0, tree.size(), 256, [&](int64_t first, int64_t last) {
    for (int64_t place = first; place < last; ++place) {
      const auto i = static_cast<size_t>(tree.PointAt(place));
      tree.Nearest(place, nearest[i]);
      typical[i] = nearest[i][kTypical - 1].squared_distance;
    }
  });
  DisjointSets sets(tree.size());
  for (size_t i = 0; i < nearest.size(); ++i) {
    for (const auto& [squared, index] : nearest[i]) {
      const auto j = static_cast<size_t>(index);
      const auto [least, most] = std::minmax(typical[i], typical[j]);
      if (squared <= kReach * kReach * least && most <= kMuchTheSame * kMuchTheSame * least) sets.Join(i, j);
    }
  }
  return sets;
}

}  // namespace

CloudComponents FindComponents(const GaussianCloud& cloud) {
  std::vector<int64_t> showing;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (HasUsableShape(cloud, i) && ShowsInPictures(cloud, static_cast<size_t>(i))) showing.push_back(i);
  }
  const int64_t count = std::ssize(showing), sampled = std::min(count, kComponentSample);
  if (count < 2 * kLeastShowing) return {};
  Buffer<float> places(static_cast<size_t>(3 * sampled));
  for (int64_t k = 0; k < sampled; ++k) {
    std::copy_n(cloud.means.data() + 3 * showing[static_cast<size_t>(k * count / sampled)], 3, places.data() + 3 * k);
  }
  DisjointSets sets = JoinNeighbours(places);
  LeaveIfAbandoned();

  std::vector<int64_t> members(static_cast<size_t>(sampled));
  for (size_t k = 0; k < members.size(); ++k) ++members[sets.Root(k)];
  const double least = std::max(kLeastOfThing * static_cast<double>(sampled),
                                static_cast<double>(kLeastShowing * sampled) / static_cast<double>(count));
  std::vector<size_t> roots;
  for (size_t k = 0; k < members.size(); ++k) {
    if (static_cast<double>(members[k]) >= least) roots.push_back(k);
  }
  if (roots.size() < 2) return {};
  std::ranges::stable_sort(roots, [&](size_t a, size_t b) { return members[a] > members[b]; });
  std::vector<int32_t> thing_of_root(members.size(), -1);
  for (size_t c = 0; c < roots.size(); ++c) thing_of_root[roots[c]] = static_cast<int32_t>(c);

  Buffer<float> known;
  std::vector<int32_t> thing;
  for (size_t k = 0; k < members.size(); ++k) {
    const int32_t of = thing_of_root[sets.Root(k)];
    if (of < 0) continue;
    thing.push_back(of);
    known.insert(known.end(), places.begin() + static_cast<int64_t>(3 * k),
                 places.begin() + static_cast<int64_t>(3 * k + 3));
  }
  const KdTree nearest_known(known);
  CloudComponents out;
  out.count = std::ssize(roots);
  out.component.assign(static_cast<size_t>(cloud.size()), 0);
  ParallelFor(0, cloud.size(), kComponentRowsPerTask, [&](int64_t first, int64_t last) {
    std::array<KdTree::Neighbour, 1> nearest;
    for (int64_t i = first; i < last; ++i) {
      if (!HasUsableShape(cloud, i)) continue;
      const float* p = cloud.means.data() + 3 * i;
      nearest_known.NearestTo({p[0], p[1], p[2]}, nearest);
      out.component[static_cast<size_t>(i)] = thing[static_cast<size_t>(nearest[0].index)];
    }
  });
  return out;
}

}  // namespace anchorsplat
