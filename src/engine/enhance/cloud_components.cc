#include "enhance/cloud_components.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/kd_tree.h"
#include "core/parallel.h"
#include "core/run_context.h"
#include "core/statistics.h"
#include "reading/visible_gaussians.h"

namespace anchorsplat {

namespace {

constexpr int64_t kComponentSample = 16'384;
// Joins neighbours among the kJoined nearest of either, if closer than a multiple of either's distance to its fourth
// and if these distances are similar. So a floater, far away in the surface's own measure, does not join, nor does a
// chain of floaters. Two spheres of 5,000 stay separate with 300 floaters among them and merge with 1,000. The largest
// piece of fits and captures holds at least nine tenths, the next at most a hundredth; with a reach of 2 these are six
// and three tenths.
constexpr size_t kJoined = 12, kTypical = 4;
constexpr double kReach = 3, kMuchTheSame = 2;
// Minimum size of a component: fewer visible Gaussians say nothing about pixels, and the sample's graph has gaps.
constexpr double kLeastShowing = 1000, kLeastOfThing = 0.005;
// A piece of this many is separate if its distance from all components is at least kAside of its own extent and
// kAsideOfThing of the nearest component's. A car's wheel is closer.
constexpr double kLeastOfPiece = 100, kAside = 0.5, kAsideOfThing = 0.05;
// A single Gaussian joins a component within this multiple of the local neighbour distance.
constexpr double kClose = 5;
constexpr int64_t kLeastSampledOfPiece = 8;
constexpr int64_t kComponentRowsPerTask = 16'384;

// Union-find; the root of a set is its first member.
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

// Neighbour graph of the sample.
struct Graph {
  Buffer<float> places;    // [n,3]
  Buffer<double> typical;  // [n] squared distances
  std::vector<size_t> root;

  const float* Place(size_t k) const { return places.data() + 3 * k; }
  size_t size() const { return root.size(); }
};

Graph JoinNeighbours(Buffer<float> places) {
  const KdTree tree(places);
  Graph graph;
  std::vector<std::array<KdTree::Neighbour, kJoined>> nearest(static_cast<size_t>(tree.size()));
  graph.typical.resize(nearest.size());
  ParallelFor(0, tree.size(), 256, [&](int64_t first, int64_t last) {
    for (int64_t place = first; place < last; ++place) {
      const auto i = static_cast<size_t>(tree.PointAt(place));
      tree.Nearest(place, nearest[i]);
      graph.typical[i] = nearest[i][kTypical - 1].squared_distance;
    }
  });
  DisjointSets sets(tree.size());
  for (size_t i = 0; i < nearest.size(); ++i) {
    for (const auto& [squared, index] : nearest[i]) {
      const auto j = static_cast<size_t>(index);
      const auto [least, most] = std::minmax(graph.typical[i], graph.typical[j]);
      if (squared <= kReach * kReach * least && most <= kMuchTheSame * kMuchTheSame * least) sets.Join(i, j);
    }
  }
  graph.root.resize(nearest.size());
  for (size_t k = 0; k < graph.size(); ++k) graph.root[k] = sets.Root(k);
  graph.places = std::move(places);
  return graph;
}

// Labels of sample points in no component.
constexpr int32_t kStray = -1, kPiece = -2;

// Nearest-neighbour search among part of the sample.
class Among {
 public:
  Among(const Graph& graph, const std::vector<int32_t>& label, bool things_only) {
    Buffer<float> places;
    for (size_t k = 0; k < graph.size(); ++k) {
      if (things_only && label[k] < 0) continue;
      index_.push_back(k);
      places.insert(places.end(), graph.Place(k), graph.Place(k) + 3);
    }
    tree_.emplace(places);
  }
  // Nearest sample point and its squared distance.
  std::pair<size_t, double> Nearest(const float* p) const {
    std::array<KdTree::Neighbour, 1> nearest;
    tree_->NearestTo({p[0], p[1], p[2]}, nearest);
    return {index_[static_cast<size_t>(nearest[0].index)], nearest[0].squared_distance};
  }

 private:
  std::vector<size_t> index_;
  std::optional<KdTree> tree_;
};

// Longest side of a component's bounding box.
double ExtentOf(const Graph& graph, const std::vector<size_t>& members) {
  double extent = 0;
  for (size_t a = 0; a < 3; ++a) {
    const auto along = [&](size_t k) { return graph.Place(k)[a]; };
    const auto [low, high] = std::ranges::minmax(members, {}, along);
    extent = std::max(extent, double{along(high)} - double{along(low)});
  }
  return extent;
}

}  // namespace

CloudComponents FindComponents(const GaussianCloud& cloud) {
  std::vector<int64_t> visible;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (HasUsableShape(cloud, i) && ShowsInPictures(cloud, static_cast<size_t>(i))) visible.push_back(i);
  }
  const int64_t count = std::ssize(visible), sampled = std::min(count, kComponentSample);
  if (static_cast<double>(count) < 2 * kLeastOfPiece) return {};
  Buffer<float> places(static_cast<size_t>(3 * sampled));
  for (int64_t k = 0; k < sampled; ++k) {
    std::copy_n(cloud.means.data() + 3 * visible[static_cast<size_t>(k * count / sampled)], 3, places.data() + 3 * k);
  }
  const Graph graph = JoinNeighbours(std::move(places));
  LeaveIfAbandoned();

  std::vector<std::vector<size_t>> components;  // not the tiny ones
  {
    std::vector<std::vector<size_t>> of_root(graph.size());
    for (size_t k = 0; k < graph.size(); ++k) of_root[graph.root[k]].push_back(k);
    for (auto& members : of_root) {
      if (std::ssize(members) >= kLeastSampledOfPiece) components.push_back(std::move(members));
    }
  }
  if (components.size() < 2) return {};
  std::ranges::stable_sort(components, std::ranges::greater(), [](const auto& members) { return members.size(); });
  const double each = static_cast<double>(count) / static_cast<double>(sampled);
  const double least = std::max(kLeastOfThing * static_cast<double>(count), kLeastShowing);
  CloudComponents out;
  out.count = std::max<int64_t>(1, std::ranges::count_if(components, [&](const auto& members) {
                                  return each * static_cast<double>(members.size()) >= least;
                                }));
  std::vector<int32_t> label(graph.size(), kStray);
  for (size_t c = 0; c < static_cast<size_t>(out.count); ++c) {
    for (const size_t k : components[c]) label[k] = static_cast<int32_t>(c);
  }

  const Among of_things(graph, label, true);
  std::vector<double> extents;
  for (const auto& members : std::span(components).first(static_cast<size_t>(out.count))) {
    extents.push_back(ExtentOf(graph, members));
  }
  bool pieces = false;
  std::vector<int32_t> with_near = label;
  for (const auto& members : std::span(components).subspan(static_cast<size_t>(out.count))) {
    std::pair<size_t, double> nearest(0, std::numeric_limits<double>::infinity());
    for (const size_t k : members) {
      const auto of_one = of_things.Nearest(graph.Place(k));
      if (of_one.second < nearest.second) nearest = of_one;
    }
    const double gap = std::sqrt(nearest.second);
    const bool aside = each * static_cast<double>(members.size()) >= kLeastOfPiece &&
                       gap >= kAside * ExtentOf(graph, members) &&
                       gap >= kAsideOfThing * extents[static_cast<size_t>(label[nearest.first])];
    pieces |= aside;
    for (const size_t k : members) with_near[k] = aside ? kPiece : label[nearest.first];
  }
  if (out.count == 1 && !pieces) return {};
  // A stray point close to a component, by the local neighbour distance, belongs to it.
  for (size_t k = 0; k < graph.size(); ++k) {
    if (with_near[k] != kStray) continue;
    const auto [of, squared] = of_things.Nearest(graph.Place(k));
    if (squared <= kClose * kClose * graph.typical[of]) with_near[k] = label[of];
  }

  const Among all(graph, with_near, false);
  out.component.assign(static_cast<size_t>(cloud.size()), CloudComponents::kNone);
  ParallelFor(0, cloud.size(), kComponentRowsPerTask, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) {
      if (!HasUsableShape(cloud, i)) continue;
      const float* p = cloud.means.data() + 3 * i;
      int32_t of = with_near[all.Nearest(p).first];
      if (of == kStray && !ShowsInPictures(cloud, static_cast<size_t>(i))) of = label[of_things.Nearest(p).first];
      out.component[static_cast<size_t>(i)] = std::max(of, CloudComponents::kNone);
    }
  });
  return out;
}

}  // namespace anchorsplat
