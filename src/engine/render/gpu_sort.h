#pragma once

#include <array>
#include <cstdint>

#include "gpu/device.h"
#include "render/gpu_layout.h"

namespace anchorsplat {

inline constexpr uint32_t GpuBlocks(uint64_t items) {
  return static_cast<uint32_t>((items + kGpuBlock - 1) / kGpuBlock);
}

// Bytes for `at_most` scanned u32, followed by the blocks' totals.
inline constexpr uint64_t GpuScanBytes(uint64_t at_most) { return 4 * (at_most + GpuBlocks(at_most)); }

// Exclusive sums (render/scan.wgsl): the sum before item i is items[i] + items[at_most + i / kGpuBlock].
struct GpuScan {
  const GpuBuffer& sizes;  // number of items: sizes[size_at], unknown to the host
  GpuSize size_at;
  const GpuBuffer& items;   // [GpuScanBytes(at_most) / 4]
  const GpuBuffer& totals;  // [16]; the total goes to totals[size_at]; must differ from `sizes`
  uint64_t at_most;         // items
};
void ScanOnGpu(GpuDevice& device, const GpuScan& scan);

// Stable ascending radix sort of 32-bit keys with their rows, SortCpu on a GPU. Input: keys[0], rows[0].
struct GpuSort {
  const GpuBuffer& sizes;  // sizes[size_at] items
  GpuSize size_at;
  std::array<const GpuBuffer*, 2> keys, rows;  // u32 [at_most]
  const GpuBuffer& tables;                     // [GpuSortTableBytes(at_most) / 4] scratch
  const GpuBuffer& totals;                     // as in GpuScan; scratch
  uint64_t at_most;                            // items
  int bits;                                    // of the largest key
};
inline constexpr uint64_t GpuSortTableBytes(uint64_t at_most) {
  return GpuScanBytes(uint64_t{16} * GpuBlocks(at_most));
}
// Returns the index (0 or 1) of the sorted keys and rows.
size_t SortOnGpu(GpuDevice& device, const GpuSort& sort);

}  // namespace anchorsplat
