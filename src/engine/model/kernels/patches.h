#pragma once

#include <cstdint>
#include <span>

#include "core/buffer.h"

namespace anchorsplat {

// PTv3 attends within patches of consecutive points of an order.
inline constexpr int64_t kPatchSize = 1024;

// Slots of the padded sequence of n points: n itself up to one patch, else the next multiple of the patch size.
int64_t PaddedCount(int64_t n, int64_t patch_size = kPatchSize);

// Which position of the order each slot of the padded sequence holds, [PaddedCount(n)]. A last patch of r < patch_size
// points is filled with the last patch_size − r points of the patch before it: they serve as keys and values there, and
// what they receive as queries is dropped. Slots of a patch are consecutive. Slot i < n holds position i.
Buffer<int32_t> PatchPositions(int64_t n, int64_t patch_size = kPatchSize);

// The same as rows of points: order[PatchPositions(n)].
Buffer<int32_t> PatchRows(std::span<const int32_t> order, int64_t patch_size = kPatchSize);

}  // namespace anchorsplat
