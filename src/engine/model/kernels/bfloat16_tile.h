#pragma once

#include <cstdint>

#include "model/kernels/matrix_tile.h"

namespace anchorsplat {

// Tiles of products of bfloat16 pairs with sums in fp32, in the best way this processor has: by its own dot products
// (AVX512_BF16), or by widening to floats. The former flushes subnormals and rounds between the two products of a pair
// differently, so the last bits depend on the machine.
struct BFloat16Product {
  int64_t rows;     // at most this many rows per tile
  int64_t columns;  // and columns, a multiple of PackedWeights::kPanel
  void (*multiply)(int64_t rows, int64_t columns, const Tile<BFloat16Pair>& tile);
};
BFloat16Product ChooseBFloat16Product();
bool UsesBFloat16Dot();  // whether it is the former

// `count` floats as (count + 1) / 2 pairs, each rounded to nearest even; NaN stays NaN.
void RoundToPairs(const float* values, int64_t count, BFloat16Pair* pairs);

}  // namespace anchorsplat
