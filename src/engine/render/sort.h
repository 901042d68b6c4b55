#pragma once

#include <cstdint>

namespace anchorsplat {

// Stable ascending radix sort of 32-bit keys with their rows, least significant digit first. Subtracting the smallest
// key saves passes: a scene between z = 1 and z = 2 needs two. The order depends only on the keys, for any number of
// threads.
struct SortParams {
  int64_t count;         // M
  uint32_t* keys;        // [M] destroyed
  int32_t* rows;         // [M] in: any, usually ascending rows; out: in order of their keys
  uint32_t* spare_keys;  // [M] scratch
  int32_t* spare_rows;   // [M] scratch
  int64_t chunks;        // C ≥ 1 pieces for parallel work
  uint32_t* histograms;  // [C, kSortBuckets] scratch
};

inline constexpr int kSortDigit = 12;  // bits; a chunk's 4096 counters fit the L1 cache
inline constexpr int64_t kSortBuckets = int64_t{1} << kSortDigit;

void SortCpu(const SortParams& p);

}  // namespace anchorsplat
