#pragma once

#include <cstdint>

#include "kernels/matrix_tile.h"

namespace anchorsplat {

// Dot products of bfloat16 pairs by AVX512_BF16 instructions, dispatched at run time. Written by hand because Highway
// 1.0.3 has no such target.
inline constexpr int64_t kBFloat16DotRows = 14;
inline constexpr int64_t kBFloat16DotColumns = 2 * PackedWeights::kPanel;
bool HasBFloat16Dot();
void MultiplyBFloat16Dot(int64_t rows, int64_t columns, const Tile<BFloat16Pair>& tile);  // requires HasBFloat16Dot()

}  // namespace anchorsplat
