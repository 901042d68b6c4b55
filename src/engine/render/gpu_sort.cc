#include "render/gpu_sort.h"

#include "render/wgsl.h"

namespace anchorsplat {

namespace {

const GpuKernel kScanBlocks = {"scan_blocks", {wgsl::kWorkgroupSumsWgsl, wgsl::kScanWgsl}};
const GpuKernel kScanSums = {"scan_sums", {wgsl::kWorkgroupSumsWgsl, wgsl::kScanWgsl}};
const GpuKernel kSortCount = {"sort_count", {wgsl::kSortWgsl}};
const GpuKernel kSortScatter = {"sort_scatter", {wgsl::kSortWgsl}};

constexpr uint32_t kDigitBits = 4, kDigits = 16;

struct ScanParameters {
  uint32_t size_at, tables, sums_at, total_at;
};
struct SortParameters {
  uint32_t shift, size_at, sums_at, unused;
};

// The last entry: totals of a sort's counts are unused.
constexpr uint32_t kNoTotal = 15;

void Scan(GpuDevice& device, const ScanParameters& parameters, const GpuBuffer& sizes, const GpuBuffer& items,
          const GpuBuffer& totals, uint64_t at_most) {
  device.Run(kScanBlocks, AsParameters(parameters), {{1, &sizes}, {2, &items}}, GpuBlocks(at_most));
  device.Run(kScanSums, AsParameters(parameters), {{1, &sizes}, {2, &items}, {3, &totals}}, 1);
}

}  // namespace

void ScanOnGpu(GpuDevice& device, const GpuScan& scan) {
  const ScanParameters parameters = {scan.size_at, 0, static_cast<uint32_t>(scan.at_most), scan.size_at};
  Scan(device, parameters, scan.sizes, scan.items, scan.totals, scan.at_most);
}

size_t SortOnGpu(GpuDevice& device, const GpuSort& sort) {
  const uint64_t table_items = uint64_t{kDigits} * GpuBlocks(sort.at_most);
  const auto sums_at = static_cast<uint32_t>(table_items);
  const ScanParameters scan = {sort.size_at, kDigits, sums_at, kNoTotal};
  size_t from = 0;
  for (uint32_t shift = 0; static_cast<int>(shift) < sort.bits; shift += kDigitBits) {
    const SortParameters pass = {shift, sort.size_at, sums_at, 0};
    const size_t to = 1 - from;
    device.Run(kSortCount, AsParameters(pass), {{1, &sort.sizes}, {2, sort.keys[from]}, {7, &sort.tables}},
               GpuBlocks(sort.at_most));
    Scan(device, scan, sort.sizes, sort.tables, sort.totals, table_items);
    device.Run(kSortScatter, AsParameters(pass),
               {{1, &sort.sizes},
                {2, sort.keys[from]},
                {3, sort.rows[from]},
                {4, sort.keys[to]},
                {5, sort.rows[to]},
                {6, &sort.tables}},
               GpuBlocks(sort.at_most));
    from = to;
  }
  return from;
}

}  // namespace anchorsplat
