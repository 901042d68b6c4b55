#include "render/sort.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <utility>

#include "core/parallel.h"
#include "render/piece.h"

namespace anchorsplat {

void SortCpu(const SortParams& p) {
  if (p.count < 2) return;
  ParallelFor(0, p.chunks, 1, [&](int64_t c, int64_t) {
    uint32_t low = p.keys[0], high = p.keys[0];
    const auto [first, last] = PieceOf(p.count, p.chunks, c);
    for (int64_t i = first; i < last; ++i) {
      low = std::min(low, p.keys[i]);
      high = std::max(high, p.keys[i]);
    }
    p.histograms[c * kSortBuckets] = low;
    p.histograms[c * kSortBuckets + 1] = high;
  });
  uint32_t smallest = p.keys[0], largest = p.keys[0];
  for (int64_t c = 0; c < p.chunks; ++c) {
    smallest = std::min(smallest, p.histograms[c * kSortBuckets]);
    largest = std::max(largest, p.histograms[c * kSortBuckets + 1]);
  }
  const int bits = std::bit_width(largest - smallest);
  const int passes = (bits + kSortDigit - 1) / kSortDigit;
  if (passes == 0) return;  // all equal
  const int digit = (bits + passes - 1) / passes;
  const uint32_t mask = (uint32_t{1} << digit) - 1;

  uint32_t* keys = p.keys;
  int32_t* rows = p.rows;
  uint32_t* to_keys = p.spare_keys;
  int32_t* to_rows = p.spare_rows;
  for (int pass = 0; pass < passes; ++pass) {
    const int shift = pass * digit;
    ParallelFor(0, p.chunks, 1, [&](int64_t c, int64_t) {
      uint32_t* histogram = p.histograms + c * kSortBuckets;
      std::fill_n(histogram, mask + size_t{1}, 0u);
      const auto [first, last] = PieceOf(p.count, p.chunks, c);
      for (int64_t i = first; i < last; ++i) ++histogram[((keys[i] - smallest) >> shift) & mask];
    });
    // Start of each chunk's part of each bucket: ordered by bucket, then chunk, which makes the sort stable.
    // Single-threaded, so it iterates along chunks, several buckets at a time.
    uint32_t starts[kSortBuckets] = {};
    for (int64_t c = 0; c < p.chunks; ++c) {
      const uint32_t* histogram = p.histograms + c * kSortBuckets;
      for (int64_t bucket = 0; bucket <= mask; ++bucket) starts[bucket] += histogram[bucket];
    }
    std::exclusive_scan(starts, starts + mask + 1, starts, 0u);
    for (int64_t c = 0; c < p.chunks; ++c) {
      uint32_t* histogram = p.histograms + c * kSortBuckets;
      for (int64_t bucket = 0; bucket <= mask; ++bucket) {
        const uint32_t own = histogram[bucket];
        histogram[bucket] = starts[bucket];
        starts[bucket] += own;
      }
    }
    ParallelFor(0, p.chunks, 1, [&](int64_t c, int64_t) {
      uint32_t* next = p.histograms + c * kSortBuckets;
      const auto [first, last] = PieceOf(p.count, p.chunks, c);
      for (int64_t i = first; i < last; ++i) {
        const uint32_t to = next[((keys[i] - smallest) >> shift) & mask]++;
        to_keys[to] = keys[i];
        to_rows[to] = rows[i];
      }
    });
    std::swap(keys, to_keys);
    std::swap(rows, to_rows);
  }
  if (rows != p.rows) std::copy_n(rows, p.count, p.rows);
}

}  // namespace anchorsplat
