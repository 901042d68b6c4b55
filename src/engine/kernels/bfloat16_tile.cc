#include "kernels/bfloat16_tile.h"

#include <algorithm>

#include "kernels/bfloat16_dot.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/bfloat16_tile.cc"
#include <hwy/foreach_target.h>  // compiles this file once per SIMD target
#include <hwy/highway.h>

#include "kernels/matrix_tile-inl.h"
#include "kernels/vector_math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {

// A bfloat16 is the upper half of a float.
template <int kRows>
HWY_NOINLINE void MultiplyPairs(const Tile<BFloat16Pair>& t) {
  const TileTag d;
  const hn::RebindToUnsigned<TileTag> du;
  using V = hn::VFromD<TileTag>;
  constexpr int kLanes = static_cast<int>(HWY_MIN(HWY_LANES(float), size_t{PackedWeights::kPanel}));
  constexpr int kVectors = static_cast<int>(PackedWeights::kPanel) / kLanes;
  const auto upper = hn::Set(du, 0xffff0000u);
  V sums[kRows][kVectors];
  ANCHORSPLAT_UNROLL
  for (int v = 0; v < kVectors; ++v) {
    const V bias = t.bias != nullptr ? hn::LoadU(d, t.bias + v * kLanes) : hn::Zero(d);
    ANCHORSPLAT_UNROLL
    for (int r = 0; r < kRows; ++r) sums[r][v] = bias;
  }
  for (int64_t k = 0; k < t.depth; ++k) {
    V first[kVectors];
    V second[kVectors];
    ANCHORSPLAT_UNROLL
    for (int v = 0; v < kVectors; ++v) {
      const auto w = hn::LoadU(du, t.weights + k * PackedWeights::kPanel + v * kLanes);
      first[v] = hn::BitCast(d, hn::ShiftLeft<16>(w));
      second[v] = hn::BitCast(d, hn::And(w, upper));
    }
    ANCHORSPLAT_UNROLL
    for (int r = 0; r < kRows; ++r) {
      const auto pair = hn::Set(du, t.input[r * t.stride + k]);
      const V x = hn::BitCast(d, hn::ShiftLeft<16>(pair));
      const V y = hn::BitCast(d, hn::And(pair, upper));
      ANCHORSPLAT_UNROLL
      for (int v = 0; v < kVectors; ++v) {
        sums[r][v] = hn::MulAdd(y, second[v], hn::MulAdd(x, first[v], sums[r][v]));
      }
    }
  }
  ANCHORSPLAT_UNROLL
  for (int r = 0; r < kRows; ++r) {
    ANCHORSPLAT_UNROLL
    for (int v = 0; v < kVectors; ++v) {
      if (t.added != nullptr) sums[r][v] = hn::Add(sums[r][v], hn::LoadU(d, t.added[r] + v * kLanes));
      hn::StoreU(sums[r][v], d, t.out[r] + v * kLanes);
    }
  }
}

template <int kRows>
void MultiplyPairRows(int64_t rows, const Tile<BFloat16Pair>& t) {
  if constexpr (kRows > 1) {
    if (rows < kRows) return MultiplyPairRows<kRows - 1>(rows, t);
  }
  MultiplyPairs<kRows>(t);
}

void MultiplyWidened(int64_t rows, int64_t columns, const Tile<BFloat16Pair>& tile) {
  MultiplyPartialPanels(rows, columns, tile, MultiplyPairRows<kTileRows>);
}

int64_t WidenedRows() { return kTileRows; }

void RoundToPairs(const float* values, int64_t count, uint16_t* out) {
  const TileTag d;
  const hn::RebindToUnsigned<TileTag> du;
  const hn::RebindToSigned<TileTag> di;
  const hn::Rebind<uint16_t, TileTag> du16;
  const auto lanes = static_cast<int64_t>(hn::Lanes(d));
  const auto round = [&](const float* from, uint16_t* to) HWY_ATTR {
    const auto upper = hn::ShiftRight<16>(hn::BitCast(du, RoundToBFloat16(d, hn::LoadU(d, from))));
    hn::StoreU(hn::DemoteTo(du16, hn::BitCast(di, upper)), du16, to);
  };
  int64_t i = 0;
  for (; i + lanes <= count; i += lanes) round(values + i, out + i);
  if (i < count) {
    float rest[PackedWeights::kPanel] = {};
    uint16_t rounded[PackedWeights::kPanel];
    std::copy(values + i, values + count, rest);
    round(rest, rounded);
    std::copy(rounded, rounded + (count - i), out + i);
  }
  if (count % 2 != 0) out[count] = 0;
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

HWY_EXPORT(MultiplyWidened);
HWY_EXPORT(WidenedRows);
HWY_EXPORT(RoundToPairs);

bool UsesBFloat16Dot() {
  // So that tests of a narrow SIMD target do not get wider instructions.
  return (hwy::SupportedTargets() & HWY_AVX3) != 0 && HasBFloat16Dot();
}

BFloat16Product ChooseBFloat16Product() {
  if (UsesBFloat16Dot()) {
    return {.rows = kBFloat16DotRows, .columns = kBFloat16DotColumns, .multiply = MultiplyBFloat16Dot};
  }
  return {.rows = HWY_DYNAMIC_DISPATCH(WidenedRows)(),
          .columns = PackedWeights::kPanel,
          .multiply = HWY_DYNAMIC_DISPATCH(MultiplyWidened)};
}

void RoundToPairs(const float* values, int64_t count, BFloat16Pair* pairs) {
  static_assert(sizeof(BFloat16Pair) == 4);
  HWY_DYNAMIC_DISPATCH(RoundToPairs)(values, count, reinterpret_cast<uint16_t*>(pairs));
}

}  // namespace anchorsplat
#endif
