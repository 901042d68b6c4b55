#include "compact/compact_blocks.h"

#include <algorithm>

#include "core/parallel.h"

namespace anchorsplat {

CompactBlocks::CompactBlocks(const CompactGraph& graph, int64_t rounds, int64_t most)
    : graph_(graph), rounds_(rounds), most_(most), places_(static_cast<size_t>(graph.count), -1) {}

void CompactBlocks::Add(int32_t row) {
  int32_t& place = places_[static_cast<size_t>(row)];
  if (place >= 0) return;
  place = static_cast<int32_t>(block_.rows.size());
  block_.rows.push_back(row);
}

const CompactBlock& CompactBlocks::Find(int64_t block) {
  for (const int32_t row : block_.rows) places_[static_cast<size_t>(row)] = -1;
  block_.rows.clear();
  block_.reach.clear();
  const int64_t m = graph_.neighbours, begin = block * most_, end = std::min(begin + most_, graph_.count);
  for (int64_t k = begin; k < end; ++k) Add(static_cast<int32_t>(k));
  block_.reach.push_back(end - begin);
  for (int64_t round = 0; round < rounds_; ++round) {
    const int64_t heard = block_.reach.back();
    for (int64_t i = round == 0 ? 0 : block_.reach[static_cast<size_t>(round) - 1]; i < heard; ++i) {
      const int32_t* from = graph_.index.data() + int64_t{block_.rows[static_cast<size_t>(i)]} * m;
      for (int64_t k = 0; k < m; ++k) Add(from[k]);
    }
    block_.reach.push_back(static_cast<int64_t>(block_.rows.size()));
  }
  const int64_t listeners = rounds_ > 0 ? block_.reach[static_cast<size_t>(rounds_) - 1] : 0;
  block_.index.resize(static_cast<size_t>(listeners * m));
  ParallelFor(0, listeners, 4096, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) {
      const int32_t* from = graph_.index.data() + int64_t{block_.rows[static_cast<size_t>(i)]} * m;
      for (int64_t k = 0; k < m; ++k) {
        block_.index[static_cast<size_t>(i * m + k)] = places_[static_cast<size_t>(from[k])];
      }
    }
  });
  return block_;
}

}  // namespace anchorsplat
