#pragma once

#include <cstdint>

#include "model/kernels/matrix_tile.h"

namespace anchorsplat {

// The processor's own dot products of bfloat16 pairs. Highway 1.0.3 knows no target that has them, so this is compiled
// for AVX512_BF16 by hand and asked for at run time.
inline constexpr int64_t kBFloat16DotRows = 14;
inline constexpr int64_t kBFloat16DotColumns = 2 * PackedWeights::kPanel;
bool HasBFloat16Dot();
void MultiplyBFloat16Dot(int64_t rows, int64_t columns, const Tile<BFloat16Pair>& tile);  // only where it has

}  // namespace anchorsplat
