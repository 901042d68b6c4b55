#pragma once

#include <cstdint>
#include <vector>

#include "compact/compact_graph.h"
#include "core/buffer.h"

namespace anchorsplat {

// Consecutive Gaussians of a graph plus their halo: all others that influence their states over the rounds of message
// passing. The block's own states are therefore bit-identical to those of the whole graph, whatever the block size.
struct CompactBlock {
  Buffer<int32_t> rows;        // Gaussians by hop distance: the block's own, those one hop away, two, …
  std::vector<int64_t> reach;  // [rounds + 1] number of rows within 0, 1, … hops
  Buffer<int32_t> index;  // [reach[rounds − 1], neighbours] neighbours as positions in `rows`; empty without rounds

  int64_t own() const { return reach.front(); }
};

// Cuts a graph into blocks of consecutive Gaussians. These should be in a spatially coherent order (CompactNeighbours):
// otherwise a halo covers much of the cloud.
class CompactBlocks {
 public:
  // `most`: Gaussians per block, > 0. The graph must outlive this object.
  CompactBlocks(const CompactGraph& graph, int64_t rounds, int64_t most);

  int64_t count() const { return (graph_.count + most_ - 1) / most_; }
  const CompactBlock& Find(int64_t block);  // valid until the next call

 private:
  void Add(int32_t row);

  const CompactGraph& graph_;
  int64_t rounds_, most_;
  CompactBlock block_;
  Buffer<int32_t> places_;  // [N] position of each Gaussian in block_.rows, −1 if absent
};

}  // namespace anchorsplat
