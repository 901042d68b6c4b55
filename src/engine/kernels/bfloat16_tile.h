#pragma once

#include <cstdint>

#include "kernels/matrix_tile.h"

namespace anchorsplat {

// Matrix tiles of bfloat16 pairs with fp32 sums, by the fastest means of this processor: AVX512_BF16 dot products, or
// widening to floats. Dot products flush subnormals and round between a pair's two products differently, so the last
// bits depend on the machine.
struct BFloat16Product {
  int64_t rows;     // maximum rows per tile
  int64_t columns;  // maximum columns per tile, a multiple of PackedWeights::kPanel
  void (*multiply)(int64_t rows, int64_t columns, const Tile<BFloat16Pair>& tile);
};
BFloat16Product ChooseBFloat16Product();
bool UsesBFloat16Dot();  // whether ChooseBFloat16Product picks dot products

// Rounds `count` floats to nearest even, as (count + 1) / 2 pairs; NaN stays NaN.
void RoundToPairs(const float* values, int64_t count, BFloat16Pair* pairs);

}  // namespace anchorsplat
