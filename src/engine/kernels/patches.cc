#include "kernels/patches.h"

namespace anchorsplat {

int64_t PaddedCount(int64_t n, int64_t patch_size) {
  return n <= patch_size ? n : (n + patch_size - 1) / patch_size * patch_size;
}

Buffer<int32_t> PatchPositions(int64_t n, int64_t patch_size) {
  const int64_t padded = PaddedCount(n, patch_size);
  Buffer<int32_t> positions(static_cast<size_t>(padded));
  for (int64_t slot = 0; slot < padded; ++slot) {
    // A borrowed slot comes one patch after the point it repeats.
    positions[static_cast<size_t>(slot)] = static_cast<int32_t>(slot < n ? slot : slot - patch_size);
  }
  return positions;
}

Buffer<int32_t> PatchRows(std::span<const int32_t> order, int64_t patch_size) {
  Buffer<int32_t> rows = PatchPositions(static_cast<int64_t>(order.size()), patch_size);
  for (int32_t& row : rows) row = order[static_cast<size_t>(row)];
  return rows;
}

}  // namespace anchorsplat
