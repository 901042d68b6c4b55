#include "kernels/bfloat16_dot.h"

#if defined(__x86_64__)

#include <immintrin.h>

#include "kernels/unroll.h"

#define ANCHORSPLAT_BF16 __attribute__((target("avx512f,avx512bw,avx512vl,avx512dq,avx512bf16")))

namespace anchorsplat {

namespace {

template <int kRows, int kPanels>
ANCHORSPLAT_BF16 __attribute__((noinline)) void MultiplyDot(const Tile<BFloat16Pair>& t) {
  constexpr int kLanes = 16;
  static_assert(PackedWeights::kPanel == kLanes);
  __m512 sums[kRows][kPanels];
  ANCHORSPLAT_UNROLL
  for (int v = 0; v < kPanels; ++v) {
    const __m512 bias = t.bias != nullptr ? _mm512_loadu_ps(t.bias + v * kLanes) : _mm512_setzero_ps();
    ANCHORSPLAT_UNROLL
    for (int r = 0; r < kRows; ++r) sums[r][v] = bias;
  }
  if (t.added != nullptr) {
    // Needed after the products; prefetched now.
    ANCHORSPLAT_UNROLL
    for (int r = 0; r < kRows; ++r) {
      ANCHORSPLAT_UNROLL
      for (int v = 0; v < kPanels; ++v) {
        _mm_prefetch(reinterpret_cast<const char*>(t.added[r] + v * kLanes), _MM_HINT_T0);
      }
    }
  }
  const BFloat16Pair* input = t.input;
  const BFloat16Pair* weights = t.weights;
  for (int64_t k = 0; k < t.depth; ++k) {
    __m512bh w[kPanels];
    ANCHORSPLAT_UNROLL
    for (int v = 0; v < kPanels; ++v) w[v] = (__m512bh)_mm512_loadu_si512(weights + v * t.panel_stride);
    ANCHORSPLAT_UNROLL
    for (int r = 0; r < kRows; ++r) {
      const __m512bh x = (__m512bh)_mm512_set1_epi32(static_cast<int32_t>(input[r * t.stride]));
      ANCHORSPLAT_UNROLL
      for (int v = 0; v < kPanels; ++v) sums[r][v] = _mm512_dpbf16_ps(sums[r][v], x, w[v]);
    }
    weights += PackedWeights::kPanel;
    ++input;
  }
  ANCHORSPLAT_UNROLL
  for (int r = 0; r < kRows; ++r) {
    ANCHORSPLAT_UNROLL
    for (int v = 0; v < kPanels; ++v) {
      if (t.added != nullptr) sums[r][v] = _mm512_add_ps(sums[r][v], _mm512_loadu_ps(t.added[r] + v * kLanes));
      _mm512_storeu_ps(t.out[r] + v * kLanes, sums[r][v]);
    }
  }
}

template <int kPanels, int kRows = kBFloat16DotRows>
void MultiplyRows(int64_t rows, const Tile<BFloat16Pair>& t) {
  if constexpr (kRows > 1) {
    if (rows < kRows) return MultiplyRows<kPanels, kRows - 1>(rows, t);
  }
  MultiplyDot<kRows, kPanels>(t);
}

}  // namespace

bool HasBFloat16Dot() {
  static const bool has = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                          __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq") &&
                          __builtin_cpu_supports("avx512bf16");
  return has;
}

void MultiplyBFloat16Dot(int64_t rows, int64_t columns, const Tile<BFloat16Pair>& tile) {
  if (columns == kBFloat16DotColumns) return MultiplyRows<2>(rows, tile);
  MultiplyPartialPanels(rows, columns, tile, MultiplyRows<1>);
}

}  // namespace anchorsplat

#else

namespace anchorsplat {

bool HasBFloat16Dot() { return false; }
void MultiplyBFloat16Dot(int64_t, int64_t, const Tile<BFloat16Pair>&) {}

}  // namespace anchorsplat

#endif
