#pragma once

#include <cstdint>
#include <span>

#include "core/buffer.h"

namespace anchorsplat {

// Rows of `width` ≥ 1 floats in another order: row i of the pieces, one after the other, becomes row places[i] of the
// result. `places` is a permutation of as many as there are rows. Every page of the result is written twice, and those
// of the pieces are read once, in their order: where they lie on disk, it is not its head that decides.
Buffer<float> ScatterRows(std::span<const std::span<const float>> pieces, int64_t width,
                          std::span<const int32_t> places);

}  // namespace anchorsplat
