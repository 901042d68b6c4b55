#pragma once

#include <cstdint>
#include <vector>

#include "core/buffer.h"
#include "model/compact/compact_graph.h"

namespace anchorsplat {

// Some Gaussians of a graph, and all others that their states hear from in a number of rounds. So a block's own states
// are those of the whole graph, bit by bit, whatever its size.
struct CompactBlock {
  Buffer<int32_t> rows;        // Gaussians: the block's own, then those one message away, two, …
  std::vector<int64_t> reach;  // [rounds + 1] how many are at most so many messages away; the first: its own
  Buffer<int32_t> index;       // [reach[rounds − 1], neighbours] as places in `rows`; empty without rounds

  int64_t own() const { return reach.front(); }
};

// Cuts a graph into blocks of Gaussians that follow each other. They should be in an order in which near ones are near
// (CompactNeighbours): otherwise a block hears from much of the cloud.
class CompactBlocks {
 public:
  // `most`: Gaussians of a block, > 0. The graph must outlive it.
  CompactBlocks(const CompactGraph& graph, int64_t rounds, int64_t most);

  int64_t count() const { return (graph_.count + most_ - 1) / most_; }
  const CompactBlock& Find(int64_t block);  // valid until the next one

 private:
  void Add(int32_t row);

  const CompactGraph& graph_;
  int64_t rounds_, most_;
  CompactBlock block_;
  Buffer<int32_t> places_;  // [N] of each Gaussian in the block, −1: it is not in it
};

}  // namespace anchorsplat
