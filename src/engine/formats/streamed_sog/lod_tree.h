#pragma once

#include <cstdint>
#include <vector>

#include "core/buffer.h"
#include "core/cloud_view.h"
#include "formats/streamed_sog/lod_options.h"

namespace anchorsplat {

// A binary tree over the Gaussians of a splat that are usable (IsUsable): each node is divided at the median of its
// means along its longest side. A leaf has at most 65,536 Gaussians, and no more than a chunk; one that is longer than
// LodOptions::chunk_extent has at most 4,096.
struct LodTree {
  struct Node {
    int64_t begin = 0, end = 0;   // of `rows`
    int64_t left = 0, right = 0;  // nodes; 0 for both: a leaf
    bool is_leaf() const { return left == 0; }
  };
  std::vector<Node> nodes;  // the first one is the root; none where nothing is usable
  Buffer<uint32_t> rows;    // of the cloud, leaf by leaf, along a Morton curve within each
};

LodTree BuildLodTree(const CloudView& cloud, const LodOptions& options);

// The leaves in the order of their rows.
std::vector<int64_t> LeavesOf(const LodTree& tree);

// The Gaussians at `rows`, in that order.
GaussianCloud GaussiansAt(const CloudView& cloud, const uint32_t* rows, int64_t count);

}  // namespace anchorsplat
