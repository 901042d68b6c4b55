// Shared by forward and backward blending of a tile: reads its Gaussians in batches and finds the 4×4-pixel blocks that
// each one reaches, and computes α. Compiled once per instruction set, as <hwy/highway.h>.

#if defined(ANCHORSPLAT_RENDER_TILE_BATCH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef ANCHORSPLAT_RENDER_TILE_BATCH_INL_H_
#undef ANCHORSPLAT_RENDER_TILE_BATCH_INL_H_
#else
#define ANCHORSPLAT_RENDER_TILE_BATCH_INL_H_
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "render/constants.h"
#include "render/projected_gaussian.h"

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<float, 16>;
using DI = hn::RebindToSigned<D>;
using V = hn::Vec<D>;
using VI = hn::Vec<DI>;
using M = hn::Mask<D>;

constexpr size_t kBlocksPerSide = kTile / kBlock;
constexpr size_t kBlocks = kBlocksPerSide * kBlocksPerSide;
constexpr size_t kPixels = kBlock * kBlock;  // per block
constexpr size_t kLanesAtMost = 16;

// A batch of Gaussians of a tile's list, small enough that all scratch stays in the L1 cache. Coordinates are relative
// to the tile's upper left corner, so floats are precise for any image size.
template <size_t kSize>
struct TileBatch {
  // Per Gaussian, in pieces that are copied whole: loading them costs more than blending a few pixels. Blending
  // broadcasts single numbers, which is as fast from here as from columns.
  alignas(64) float at[kSize][2];     // x, y
  alignas(64) float shape[kSize][4];  // u_xx, u_xy, u_yy, log2_opacity
  alignas(64) float seen[kSize][4];   // red, green, blue, depth
  // Indices of the batch per block, in order, with room for the last register stored.
  alignas(64) int32_t lists[kBlocks][kSize + kLanesAtMost];
  size_t list_sizes[kBlocks];
};

struct PixelOffsets {
  alignas(64) float x[kPixels], y[kPixels];
};
constexpr PixelOffsets MakePixelOffsets() {  // pixel centres of a block, row-major
  PixelOffsets o{};
  for (size_t i = 0; i < kPixels; ++i) {
    o.x[i] = static_cast<float>(i % kBlock) + 0.5f;
    o.y[i] = static_cast<float>(i / kBlock) + 0.5f;
  }
  return o;
}
constexpr PixelOffsets kPixelOffsets = MakePixelOffsets();

// 2^x for −126 ≤ x ≤ 0, relative error below 2e-7 (Chebyshev-weighted fit); undefined for other x.
HWY_INLINE V Exp2(V x) {
  const D d;
  const DI di;
  // Adding 1.5·2^23 puts the nearest integer in the low mantissa bits, which are shifted into the exponent.
  const V magic = hn::Set(d, 12582912.0f);
  const V shifted = hn::Add(x, magic);
  const V f = hn::Sub(x, hn::Sub(shifted, magic));  // −½ … ½
  V p = hn::Set(d, 1.326472725e-3f);
  p = hn::MulAdd(p, f, hn::Set(d, 9.671512688e-3f));
  p = hn::MulAdd(p, f, hn::Set(d, 5.550733744e-2f));
  p = hn::MulAdd(p, f, hn::Set(d, 2.402224208e-1f));
  p = hn::MulAdd(p, f, hn::Set(d, 6.931469776e-1f));
  p = hn::MulAdd(p, f, hn::Set(d, 1.0f));
  return hn::BitCast(d, hn::Add(hn::BitCast(di, p), hn::ShiftLeft<23>(hn::BitCast(di, shifted))));
}

// Prefetches the Gaussians of rows[0, n) while the previous ones are processed.
HWY_INLINE void Fetch(const ProjectedGaussian* projected, const int32_t* rows, size_t n) {
  for (size_t j = 0; j < n; ++j) hwy::Prefetch(projected + rows[j]);
}

// Copies the Gaussians of rows[0, n) and pads the last register with ones that hit nothing.
template <size_t kSize>
void ReadBatch(const ProjectedGaussian* projected, const int32_t* rows, size_t n, double tile_x, double tile_y,
               TileBatch<kSize>& t) {
  constexpr size_t kAhead = 32;  // enough for L3 latency, as the rows of a tile are scattered
  for (size_t j = 0; j < std::min(n, kAhead); ++j) hwy::Prefetch(projected + rows[j]);
  for (size_t j = 0; j < n; ++j) {
    if (j + kAhead < n) hwy::Prefetch(projected + rows[j + kAhead]);
    const ProjectedGaussian& g = projected[rows[j]];
    t.at[j][0] = static_cast<float>(g.x - tile_x);
    t.at[j][1] = static_cast<float>(g.y - tile_y);
    const std::byte* record = reinterpret_cast<const std::byte*>(&g);
    std::memcpy(t.shape[j], record + offsetof(ProjectedGaussian, u_xx), sizeof(t.shape[j]));
    std::memcpy(t.seen[j], record + offsetof(ProjectedGaussian, rgb), sizeof(t.seen[j]));
  }
  for (size_t j = n; j < (n + kLanesAtMost - 1) / kLanesAtMost * kLanesAtMost; ++j) {
    t.at[j][0] = t.at[j][1] = 0;
    t.shape[j][0] = t.shape[j][1] = t.shape[j][2] = 1;
    t.shape[j][3] = -1e30f;
  }
}

// log2 α of Gaussian j of the batch at pixel centres of the tile. Computed only here, as forward and backward must
// agree on every pixel.
template <size_t kSize>
HWY_INLINE V Log2Alpha(const TileBatch<kSize>& t, size_t j, V dx, V dy) {
  const D d;
  const V u = hn::MulAdd(hn::Set(d, t.shape[j][0]), dx, hn::Mul(hn::Set(d, t.shape[j][1]), dy));
  const V v = hn::Mul(hn::Set(d, t.shape[j][2]), dy);
  return hn::NegMulAdd(u, u, hn::NegMulAdd(v, v, hn::Set(d, t.shape[j][3])));
}

HWY_INLINE V ClampTo(V x, V low, V high) { return hn::Min(hn::Max(x, low), high); }

// Builds each block's list: Gaussians whose ellipse α = min_alpha reaches a pixel centre of the block. Finished blocks
// get none.
template <size_t kSize>
void ListBlocks(float log2_min_alpha, size_t n, const bool* finished, TileBatch<kSize>& t) {
  const D d;
  const DI di;
  const size_t lanes = hn::Lanes(d);
  const V zero = hn::Zero(d);
  std::fill_n(t.list_sizes, kBlocks, size_t{0});
  for (size_t j = 0; j < n; j += lanes) {
    V x, y, u_xx, u_xy, u_yy, log2_opacity;
    hn::LoadInterleaved2(d, t.at[j], x, y);
    hn::LoadInterleaved4(d, t.shape[j], u_xx, u_xy, u_yy, log2_opacity);
    // u² + v² ≤ reach², so at height dy:  dx ∈ shear·dy ± half·sqrt(reach² − v²).
    const V reach2 = hn::Sub(log2_opacity, hn::Set(d, log2_min_alpha));
    const V half = hn::Div(hn::Set(d, 1.0f), u_xx);
    const V shear = hn::Neg(hn::Mul(u_xy, half));
    const V height = hn::Div(hn::Sqrt(hn::Max(reach2, zero)), u_yy);
    const V slope = hn::Mul(half, u_yy);
    // Height of the rightmost point of the ellipse; the leftmost one is opposite.
    const V rightmost = hn::Div(hn::Mul(height, shear), hn::Sqrt(hn::MulAdd(shear, shear, hn::Mul(slope, slope))));
    // Margin against rounding; false positives are dropped by the exact test per pixel.
    const V margin = hn::MulAdd(hn::Set(d, 4e-6f), hn::Add(hn::Abs(x), hn::Abs(y)), hn::Set(d, 0.01f));
    const M hits = hn::Ge(reach2, zero);
    const VI index = hn::Iota(di, static_cast<int32_t>(j));
    for (size_t row = 0; row < kBlocksPerSide; ++row) {
      const float first_y = static_cast<float>(row * kBlock) + 0.5f;
      const V top = hn::Max(hn::Sub(hn::Sub(hn::Set(d, first_y), margin), y), hn::Neg(height));
      const V bottom = hn::Min(hn::Sub(hn::Add(hn::Set(d, first_y + kBlock - 1), margin), y), height);
      const M in_row = hn::And(hits, hn::Le(top, bottom));
      if (hn::AllFalse(d, in_row)) continue;
      const V right_y = ClampTo(rightmost, top, bottom), left_y = ClampTo(hn::Neg(rightmost), top, bottom);
      const V right_v = hn::Mul(u_yy, right_y), left_v = hn::Mul(u_yy, left_y);
      const V right_chord = hn::Sqrt(hn::Max(hn::NegMulAdd(right_v, right_v, reach2), zero));
      const V left_chord = hn::Sqrt(hn::Max(hn::NegMulAdd(left_v, left_v, reach2), zero));
      const V right = hn::Add(hn::Add(x, margin), hn::MulAdd(half, right_chord, hn::Mul(shear, right_y)));
      const V left = hn::Sub(hn::Sub(x, margin), hn::NegMulAdd(shear, left_y, hn::Mul(half, left_chord)));
      for (size_t column = 0; column < kBlocksPerSide; ++column) {
        const size_t block = row * kBlocksPerSide + column;
        if (finished[block]) continue;
        const float first_x = static_cast<float>(column * kBlock) + 0.5f;
        const M reaches = hn::And(hn::Ge(right, hn::Set(d, first_x)), hn::Le(left, hn::Set(d, first_x + kBlock - 1)));
        const auto hit = hn::RebindMask(di, hn::And(in_row, reaches));
        // Compress and store separately: the fused instruction is microcoded on some processors.
        hn::StoreU(hn::Compress(index, hit), di, t.lists[block] + t.list_sizes[block]);
        t.list_sizes[block] += hn::CountTrue(di, hit);
      }
    }
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#endif  // per target
