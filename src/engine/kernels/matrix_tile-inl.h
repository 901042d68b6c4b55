// The inner loop of every matrix product of the network, compiled once per SIMD target (hence the unusual include
// guard).
#if defined(ANCHORSPLAT_MODEL_MATRIX_TILE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef ANCHORSPLAT_MODEL_MATRIX_TILE_INL_H_
#undef ANCHORSPLAT_MODEL_MATRIX_TILE_INL_H_
#else
#define ANCHORSPLAT_MODEL_MATRIX_TILE_INL_H_
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <cstdint>

#include "kernels/matrix_tile.h"
#include "kernels/packed_weights.h"
#include "kernels/unroll.h"

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// At most one panel wide, so that a panel is a whole number of vectors.
using TileTag = hn::CappedTag<float, PackedWeights::kPanel>;

// A tile's sums stay in registers: rows × vectors of them, plus vectors of weights and one input.
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL
inline constexpr int kTilePanels = 2;  // 14 · 2 of 32 registers
inline constexpr int kTileRows = 14;
#elif HWY_TARGET == HWY_AVX2
inline constexpr int kTilePanels = 1;  // 6 · 2 of 16
inline constexpr int kTileRows = 6;
#elif HWY_TARGET == HWY_NEON
inline constexpr int kTilePanels = 1;  // 6 · 4 of 32
inline constexpr int kTileRows = 6;
#else
inline constexpr int kTilePanels = 1;  // 2 · 4 of 16: SSE has no fused multiply-add, the product needs a register too
inline constexpr int kTileRows = 2;
#endif
inline constexpr int64_t kTileColumns = kTilePanels * PackedWeights::kPanel;

static_assert(kTileRows <= kMostTileRows);

template <int kRows, int kPanels>
HWY_INLINE void MultiplyTile(const Tile<float>& t) {
  const TileTag d;
  using V = hn::VFromD<TileTag>;
  constexpr int kLanes = static_cast<int>(HWY_MIN(HWY_LANES(float), size_t{PackedWeights::kPanel}));
  constexpr int kPerPanel = static_cast<int>(PackedWeights::kPanel) / kLanes;
  constexpr int kVectors = kPanels * kPerPanel;
  V sums[kRows][kVectors];
  if (t.bias != nullptr) {
    ANCHORSPLAT_UNROLL
    for (int v = 0; v < kVectors; ++v) {
      const V bias = hn::LoadU(d, t.bias + v * kLanes);
      ANCHORSPLAT_UNROLL
      for (int r = 0; r < kRows; ++r) sums[r][v] = bias;
    }
  } else {
    ANCHORSPLAT_UNROLL
    for (int v = 0; v < kVectors; ++v) {
      ANCHORSPLAT_UNROLL
      for (int r = 0; r < kRows; ++r) sums[r][v] = hn::Zero(d);
    }
  }
  if (t.added != nullptr) {
    // Needed after the products; prefetched now.
    ANCHORSPLAT_UNROLL
    for (int r = 0; r < kRows; ++r) {
      ANCHORSPLAT_UNROLL
      for (int i = 0; i < kPanels; ++i) hwy::Prefetch(t.added[r] + i * PackedWeights::kPanel);
    }
  }
  const float* HWY_RESTRICT input = t.input;
  const float* HWY_RESTRICT weights = t.weights;
  for (int64_t k = 0; k < t.depth; ++k) {
    V w[kVectors];
    ANCHORSPLAT_UNROLL
    for (int v = 0; v < kVectors; ++v) {
      w[v] = hn::LoadU(d, weights + v / kPerPanel * t.panel_stride + v % kPerPanel * kLanes);
    }
    ANCHORSPLAT_UNROLL
    for (int r = 0; r < kRows; ++r) {
      const V x = hn::Set(d, input[r * t.stride]);
      ANCHORSPLAT_UNROLL
      for (int v = 0; v < kVectors; ++v) sums[r][v] = hn::MulAdd(x, w[v], sums[r][v]);
    }
    weights += PackedWeights::kPanel;
    ++input;
  }
  if (t.added != nullptr) {
    ANCHORSPLAT_UNROLL
    for (int r = 0; r < kRows; ++r) {
      ANCHORSPLAT_UNROLL
      for (int v = 0; v < kVectors; ++v) sums[r][v] = hn::Add(sums[r][v], hn::LoadU(d, t.added[r] + v * kLanes));
    }
  }
  ANCHORSPLAT_UNROLL
  for (int r = 0; r < kRows; ++r) {
    ANCHORSPLAT_UNROLL
    for (int v = 0; v < kVectors; ++v) hn::StoreU(sums[r][v], d, t.out[r] + v * kLanes);
  }
}

template <int kRows, int kPanels>
HWY_NOINLINE void MultiplyTileOutOfLine(const Tile<float>& t) {
  MultiplyTile<kRows, kPanels>(t);
}

// `rows` ≤ kRows.
template <int kPanels, int kRows = kTileRows>
HWY_INLINE void MultiplyRows(int64_t rows, const Tile<float>& t) {
  if constexpr (kRows > 1) {
    if (rows < kRows) return MultiplyRows<kPanels, kRows - 1>(rows, t);
  }
  MultiplyTileOutOfLine<kRows, kPanels>(t);
}

// A tile of rows ≤ kTileRows and columns ≤ kTileColumns.
HWY_INLINE void MultiplyTile(int64_t rows, int64_t columns, const Tile<float>& t) {
  if (columns == kTileColumns) return MultiplyRows<kTilePanels>(rows, t);
  MultiplyPartialPanels(rows, columns, t, [](int64_t n, const Tile<float>& panel) { MultiplyRows<1>(n, panel); });
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#endif
