#pragma once

#include <cstdint>
#include <vector>

#include "core/buffer.h"
#include "core/cloud_view.h"
#include "formats/streamed_sog/lod_options.h"

namespace anchorsplat {

// A binary tree over the usable Gaussians (IsUsable) of a splat: nodes are split at the median along their longest
// side. A leaf has at most 65,536 Gaussians and at most a chunk; one longer than LodOptions::chunk_extent at most
// 4,096.
struct LodTree {
  struct Node {
    int64_t begin = 0, end = 0;   // range in `rows`
    int64_t left = 0, right = 0;  // child nodes; both 0: a leaf
    bool is_leaf() const { return left == 0; }
  };
  std::vector<Node> nodes;  // the first is the root; empty if nothing is usable
  Buffer<uint32_t> rows;    // rows of the cloud, leaf by leaf, in Morton order within each
};

LodTree BuildLodTree(const CloudView& cloud, const LodOptions& options);

// Leaves in the order of their rows.
std::vector<int64_t> LeavesOf(const LodTree& tree);

// Copies the Gaussians at `rows`, in that order.
GaussianCloud GaussiansAt(const CloudView& cloud, const uint32_t* rows, int64_t count);

}  // namespace anchorsplat
