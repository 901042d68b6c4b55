#pragma once

#include <array>
#include <cstdint>

#include "gpu/device.h"
#include "render/gpu_layout.h"

namespace anchorsplat {

inline constexpr uint32_t GpuBlocks(uint64_t items) {
  return static_cast<uint32_t>((items + kGpuBlock - 1) / kGpuBlock);
}

// Bytes of `at_most` u32 that are scanned, with the blocks' totals behind them.
inline constexpr uint64_t GpuScanBytes(uint64_t at_most) { return 4 * (at_most + GpuBlocks(at_most)); }

// Exclusive sums (render/scan.wgsl): before item i come items[i] + items[at_most + i / kGpuBlock].
struct GpuScan {
  const GpuBuffer& sizes;  // how many items there are: sizes[size_at], which is not known here
  GpuSize size_at;
  const GpuBuffer& items;   // [GpuScanBytes(at_most) / 4]
  const GpuBuffer& totals;  // [16]; the sum of all goes to totals[size_at]. Another buffer than `sizes`
  uint64_t at_most;         // items
};
void ScanOnGpu(GpuDevice& device, const GpuScan& scan);

// Stable ascending radix sort of 32-bit keys with their rows, the twin of SortCpu. In: keys[0], rows[0].
struct GpuSort {
  const GpuBuffer& sizes;  // sizes[size_at] items
  GpuSize size_at;
  std::array<const GpuBuffer*, 2> keys, rows;  // u32 [at_most]
  const GpuBuffer& tables;                     // [GpuSortTableBytes(at_most) / 4] scratch
  const GpuBuffer& totals;                     // as of GpuScan; scratch
  uint64_t at_most;                            // items
  int bits;                                    // of the largest key
};
inline constexpr uint64_t GpuSortTableBytes(uint64_t at_most) {
  return GpuScanBytes(uint64_t{16} * GpuBlocks(at_most));
}
// Returns which of keys and rows are the sorted ones, 0 or 1.
size_t SortOnGpu(GpuDevice& device, const GpuSort& sort);

}  // namespace anchorsplat
