#pragma once

#include <cstdint>
#include <span>

#include "core/buffer.h"

namespace anchorsplat {

// Reorders rows of `width` ≥ 1 floats: row i of the concatenated `pieces` becomes row places[i] of the result. `places`
// is a permutation of all rows. Pieces are read once in order and each page of the result is written twice, so that the
// order of rows never causes random disk access when Buffers lie on disk (core/memory_limit.h).
Buffer<float> ScatterRows(std::span<const std::span<const float>> pieces, int64_t width,
                          std::span<const int32_t> places);

}  // namespace anchorsplat
