#include "formats/streamed_sog/lod_tree.h"

#include <algorithm>
#include <array>
#include <limits>

#include "core/parallel.h"
#include "core/statistics.h"
#include "formats/splat_order.h"

namespace anchorsplat {

namespace {

constexpr int64_t kMostInLeaf = 1 << 16;
constexpr int64_t kLongLeaf = 1 << 12;  // so that a distant Gaussian does not get its own chunk
constexpr int64_t kGatherGrain = 1 << 12;

class TreeBuilder {
 public:
  TreeBuilder(const CloudView& cloud, const LodOptions& options, LodTree& tree)
      : cloud_(cloud), options_(options), tree_(tree) {}

  int64_t Build(int64_t begin, int64_t end) {
    const auto node = static_cast<int64_t>(tree_.nodes.size());
    tree_.nodes.push_back({begin, end});
    const auto [axis, length] = LongestSide(begin, end);
    const int64_t count = end - begin;
    const int64_t most = std::min<int64_t>(kMostInLeaf, int64_t{1024} * options_.chunk_count);
    if (count <= most && (length <= options_.chunk_extent || count <= kLongLeaf)) {
      SortLeaf(begin, end);
      return node;
    }
    const int64_t middle = begin + count / 2;
    const auto coordinate = [this, axis = axis](uint32_t row) { return cloud_.means[3 * size_t{row} + axis]; };
    std::nth_element(tree_.rows.begin() + begin, tree_.rows.begin() + middle, tree_.rows.begin() + end,
                     [&](uint32_t a, uint32_t b) {
                       const float x = coordinate(a), y = coordinate(b);
                       return x != y ? x < y : a < b;
                     });
    const int64_t left = Build(begin, middle);
    const int64_t right = Build(middle, end);
    tree_.nodes[static_cast<size_t>(node)].left = left;
    tree_.nodes[static_cast<size_t>(node)].right = right;
    return node;
  }

 private:
  struct Side {
    size_t axis = 0;
    double length = 0;
  };

  Side LongestSide(int64_t begin, int64_t end) const {
    std::array<float, 3> min, max;
    min.fill(std::numeric_limits<float>::infinity());
    max.fill(-std::numeric_limits<float>::infinity());
    for (int64_t i = begin; i < end; ++i) {
      const float* mean = cloud_.means.data() + 3 * size_t{tree_.rows[static_cast<size_t>(i)]};
      for (size_t k = 0; k < 3; ++k) {
        min[k] = std::min(min[k], mean[k]);
        max[k] = std::max(max[k], mean[k]);
      }
    }
    Side side;
    for (size_t k = 0; k < 3; ++k) {
      const double length = double{max[k]} - double{min[k]};
      if (length > side.length) side = {k, length};
    }
    return side;
  }

  void SortLeaf(int64_t begin, int64_t end) {
    // std::nth_element leaves an unspecified order; ties of cells are resolved by the cloud's.
    std::sort(tree_.rows.begin() + begin, tree_.rows.begin() + end);
    const Buffer<uint32_t> own(tree_.rows.begin() + begin, tree_.rows.begin() + end);
    Buffer<float> means(3 * own.size());
    for (size_t i = 0; i < own.size(); ++i) {
      for (size_t k = 0; k < 3; ++k) means[3 * i + k] = cloud_.means[3 * size_t{own[i]} + k];
    }
    const Buffer<uint32_t> order = MortonOrder(means);
    for (size_t i = 0; i < own.size(); ++i) tree_.rows[static_cast<size_t>(begin) + i] = own[order[i]];
  }

  const CloudView& cloud_;
  const LodOptions& options_;
  LodTree& tree_;
};

}  // namespace

LodTree BuildLodTree(const CloudView& cloud, const LodOptions& options) {
  LodTree tree;
  tree.rows.reserve(static_cast<size_t>(cloud.size()));
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (IsUsable(cloud, i)) tree.rows.push_back(static_cast<uint32_t>(i));
  }
  if (!tree.rows.empty()) TreeBuilder(cloud, options, tree).Build(0, static_cast<int64_t>(tree.rows.size()));
  return tree;
}

std::vector<int64_t> LeavesOf(const LodTree& tree) {
  std::vector<int64_t> leaves;  // nodes are sorted by first row, parents before children
  for (size_t k = 0; k < tree.nodes.size(); ++k) {
    if (tree.nodes[k].is_leaf()) leaves.push_back(static_cast<int64_t>(k));
  }
  return leaves;
}

GaussianCloud GaussiansAt(const CloudView& cloud, const uint32_t* rows, int64_t count) {
  GaussianCloud out;
  out.Resize(count, cloud.sh_degree);
  out.render_mode = cloud.render_mode;
  out.comments.assign(cloud.comments.begin(), cloud.comments.end());
  const auto gather = [&](std::span<const float> from, int64_t width, Buffer<float>& to) {
    ParallelFor(0, count, kGatherGrain, [&](int64_t first, int64_t last) {
      for (int64_t i = first; i < last; ++i)
        std::copy_n(from.data() + int64_t{rows[i]} * width, width, to.data() + i * width);
    });
  };
  gather(cloud.means, 3, out.means);
  gather(cloud.log_scales, 3, out.log_scales);
  gather(cloud.quats, 4, out.quats);
  gather(cloud.opacity_logits, 1, out.opacity_logits);
  gather(cloud.sh, cloud.sh_stride(), out.sh);
  return out;
}

}  // namespace anchorsplat
