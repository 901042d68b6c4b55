#pragma once

#include <cstdint>
#include <span>

#include "core/buffer.h"

namespace anchorsplat {

// PTv3 attends within patches: this many consecutive points of an order.
inline constexpr int64_t kPatchSize = 1024;

// Slots of the padded sequence of n points: n up to one patch, else rounded up to whole patches.
int64_t PaddedCount(int64_t n, int64_t patch_size = kPatchSize);

// Position in the order that each slot of the padded sequence holds, [PaddedCount(n)]. A last patch with r < patch_size
// points borrows the last patch_size − r points of the patch before it as keys and values; their results as queries are
// dropped. Slots of a patch are consecutive. Slot i < n holds position i.
Buffer<int32_t> PatchPositions(int64_t n, int64_t patch_size = kPatchSize);

// The same as point rows: order[PatchPositions(n)].
Buffer<int32_t> PatchRows(std::span<const int32_t> order, int64_t patch_size = kPatchSize);

}  // namespace anchorsplat
