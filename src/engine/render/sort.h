#pragma once

#include <cstdint>

namespace anchorsplat {

// Stable ascending radix sort of 32-bit keys with their rows, least significant digit first. Keys that differ only in
// few bits take fewer passes: the smallest key is subtracted first, so a scene between z = 1 and z = 2 needs two.
// The order depends on the keys alone, so any number of threads gives the same.
struct SortParams {
  int64_t count;         // M
  uint32_t* keys;        // [M] destroyed
  int32_t* rows;         // [M] in: anything, usually ascending rows; out: in order of their keys
  uint32_t* spare_keys;  // [M] scratch
  int32_t* spare_rows;   // [M] scratch
  int64_t chunks;        // C ≥ 1 pieces that may be worked on at the same time
  uint32_t* histograms;  // [C, kSortBuckets] scratch
};

inline constexpr int kSortDigit = 12;  // bits; 4096 counters of a chunk still fit the L1 cache
inline constexpr int64_t kSortBuckets = int64_t{1} << kSortDigit;

void SortCpu(const SortParams& p);

}  // namespace anchorsplat
