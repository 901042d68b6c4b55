#include "render/blend.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/parallel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/blend.cc"
// foreach_target compiles this file once per instruction set, so it must come first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

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

constexpr size_t kBatch = 256;  // Gaussians of a tile's list taken at once: all scratch stays in L1
constexpr size_t kBlocksPerSide = kTile / kBlock;
constexpr size_t kBlocks = kBlocksPerSide * kBlocksPerSide;
constexpr size_t kPixels = kBlock * kBlock;  // of a block
constexpr size_t kLanesAtMost = 16;

// One tile at work. Coordinates are relative to its upper left corner, so floats are fine enough on any image.
struct Tile {
  // The batch, column by column.
  alignas(64) float x[kBatch], y[kBatch], u_xx[kBatch], u_xy[kBatch], u_yy[kBatch], log2_opacity[kBatch];
  alignas(64) float red[kBatch], green[kBatch], blue[kBatch], depth[kBatch];
  // Which of the batch each block looks at, in order; room for the register that is stored at the end.
  alignas(64) int32_t lists[kBlocks][kBatch + kLanesAtMost];
  size_t list_sizes[kBlocks];
  bool finished[kBlocks];  // no pixel of the block can change any more

  // Pixels. `passed` keeps shrinking after a pixel stopped, `transmittance` keeps its value; see BlendLanes.
  alignas(64) float passed[kBlocks][kPixels], transmittance[kBlocks][kPixels];
  alignas(64) float color[3][kBlocks][kPixels], weighted_depth[kBlocks][kPixels], weights[kBlocks][kPixels];
  alignas(64) int32_t contributors[kBlocks][kPixels];
};

struct PixelOffsets {
  alignas(64) float x[kPixels], y[kPixels];
};
constexpr PixelOffsets MakePixelOffsets() {  // pixel centres of a block, row by row
  PixelOffsets o{};
  for (size_t i = 0; i < kPixels; ++i) {
    o.x[i] = static_cast<float>(i % kBlock) + 0.5f;
    o.y[i] = static_cast<float>(i / kBlock) + 0.5f;
  }
  return o;
}
constexpr PixelOffsets kPixelOffsets = MakePixelOffsets();

// 2^x for −126 ≤ x ≤ 0, relative error below 2e-7 (Chebyshev-weighted fit); anything for other x.
HWY_INLINE V Exp2(V x) {
  const D d;
  const DI di;
  // Adding 1.5·2^23 leaves the nearest integer in the low mantissa bits, from where it is shifted into the exponent.
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

// Copies the Gaussians of rows[0, n) into columns and fills the last register up with ones that hit nothing.
void ReadBatch(const BlendParams& p, const int32_t* rows, size_t n, double tile_x, double tile_y, Tile& t) {
  constexpr size_t kAhead = 8;
  for (size_t j = 0; j < n; ++j) {
    if (j + kAhead < n) hwy::Prefetch(p.projected + rows[j + kAhead]);
    const ProjectedGaussian& g = p.projected[rows[j]];
    t.x[j] = static_cast<float>(g.x - tile_x);
    t.y[j] = static_cast<float>(g.y - tile_y);
    t.u_xx[j] = g.u_xx;
    t.u_xy[j] = g.u_xy;
    t.u_yy[j] = g.u_yy;
    t.log2_opacity[j] = g.log2_opacity;
    t.red[j] = g.rgb[0];
    t.green[j] = g.rgb[1];
    t.blue[j] = g.rgb[2];
    t.depth[j] = g.depth;
  }
  for (size_t j = n; j < (n + kLanesAtMost - 1) / kLanesAtMost * kLanesAtMost; ++j) {
    t.x[j] = t.y[j] = 0;
    t.u_xx[j] = t.u_xy[j] = t.u_yy[j] = 1;
    t.log2_opacity[j] = -1e30f;
  }
}

HWY_INLINE V ClampTo(V x, V low, V high) { return hn::Min(hn::Max(x, low), high); }

// Appends to each block's list those of the batch whose ellipse α = min_alpha reaches a pixel centre of the block.
void ListBlocks(float log2_min_alpha, size_t n, Tile& t) {
  const D d;
  const DI di;
  const size_t lanes = hn::Lanes(d);
  const V zero = hn::Zero(d);
  std::fill_n(t.list_sizes, kBlocks, size_t{0});
  for (size_t j = 0; j < n; j += lanes) {
    const V x = hn::Load(d, t.x + j), y = hn::Load(d, t.y + j);
    const V u_xx = hn::Load(d, t.u_xx + j), u_xy = hn::Load(d, t.u_xy + j), u_yy = hn::Load(d, t.u_yy + j);
    // u² + v² ≤ reach², so at height dy:  dx ∈ shear·dy ± half·sqrt(reach² − v²).
    const V reach2 = hn::Sub(hn::Load(d, t.log2_opacity + j), hn::Set(d, log2_min_alpha));
    const V half = hn::Div(hn::Set(d, 1.0f), u_xx);
    const V shear = hn::Neg(hn::Mul(u_xy, half));
    const V height = hn::Div(hn::Sqrt(hn::Max(reach2, zero)), u_yy);
    const V slope = hn::Mul(half, u_yy);
    // Height of the rightmost point of the ellipse; the leftmost one is opposite.
    const V rightmost = hn::Div(hn::Mul(height, shear), hn::Sqrt(hn::MulAdd(shear, shear, hn::Mul(slope, slope))));
    // Against rounding here; who is listed for nothing is dropped by the exact test of its pixels.
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
        if (t.finished[block]) continue;
        const float first_x = static_cast<float>(column * kBlock) + 0.5f;
        const M reaches = hn::And(hn::Ge(right, hn::Set(d, first_x)), hn::Le(left, hn::Set(d, first_x + kBlock - 1)));
        const auto hit = hn::RebindMask(di, hn::And(in_row, reaches));
        // Compress and store apart: the fused instruction is microcode on some processors.
        hn::StoreU(hn::Compress(index, hit), di, t.lists[block] + t.list_sizes[block]);
        t.list_sizes[block] += hn::CountTrue(di, hit);
      }
    }
  }
}

struct Limits {
  float log2_min_alpha, max_alpha, min_transmittance;
};

// Composites a block's list onto as many of its pixels as a register holds, from pixel `first` on. Returns whether all
// of them are finished. `place` is the batch's first place in the tile's list.
template <bool kDepth, bool kContributors>
HWY_INLINE bool BlendLanes(const Limits& limits, size_t block, size_t first, int32_t place, Tile& t) {
  const D d;
  const DI di;
  const V pixel_x =
      hn::Add(hn::Load(d, kPixelOffsets.x + first), hn::Set(d, static_cast<float>(block % kBlocksPerSide * kBlock)));
  const V pixel_y =
      hn::Add(hn::Load(d, kPixelOffsets.y + first), hn::Set(d, static_cast<float>(block / kBlocksPerSide * kBlock)));
  const V log2_min_alpha = hn::Set(d, limits.log2_min_alpha);
  const V max_alpha = hn::Set(d, limits.max_alpha);
  const V min_transmittance = hn::Set(d, limits.min_transmittance);
  V passed = hn::Load(d, t.passed[block] + first);
  V transmittance = hn::Load(d, t.transmittance[block] + first);
  V red = hn::Load(d, t.color[0][block] + first);
  V green = hn::Load(d, t.color[1][block] + first);
  V blue = hn::Load(d, t.color[2][block] + first);
  V depth = hn::Load(d, t.weighted_depth[block] + first), weights = hn::Load(d, t.weights[block] + first);
  VI contributors = hn::Load(di, t.contributors[block] + first);
  const int32_t* list = t.lists[block];
  const int32_t* end = list + t.list_sizes[block];
  bool finished = false;
  for (; list != end; ++list) {
    const size_t j = static_cast<size_t>(*list);
    const V dx = hn::Sub(pixel_x, hn::Set(d, t.x[j])), dy = hn::Sub(pixel_y, hn::Set(d, t.y[j]));
    const V u = hn::MulAdd(hn::Set(d, t.u_xx[j]), dx, hn::Mul(hn::Set(d, t.u_xy[j]), dy));
    const V v = hn::Mul(hn::Set(d, t.u_yy[j]), dy);
    const V log2_alpha = hn::NegMulAdd(u, u, hn::NegMulAdd(v, v, hn::Set(d, t.log2_opacity[j])));
    const M seen = hn::Ge(log2_alpha, log2_min_alpha);
    const V alpha = hn::Min(Exp2(log2_alpha), max_alpha);
    const V weight = hn::Mul(alpha, passed);
    const V next = hn::NegMulAdd(passed, alpha, passed);
    // A pixel stops at the first `next` that is too small. `passed` takes that step nevertheless and stays too small
    // ever after, which spares a mask of stopped pixels and keeps the chain from one Gaussian to the next short.
    passed = hn::IfThenElse(seen, next, passed);
    const M open = hn::Gt(passed, min_transmittance);
    const M added = hn::And(seen, open);
    const V w = hn::IfThenElseZero(added, weight);
    red = hn::MulAdd(w, hn::Set(d, t.red[j]), red);
    green = hn::MulAdd(w, hn::Set(d, t.green[j]), green);
    blue = hn::MulAdd(w, hn::Set(d, t.blue[j]), blue);
    if constexpr (kDepth) {
      depth = hn::MulAdd(w, hn::Set(d, t.depth[j]), depth);
      weights = hn::Add(weights, w);
    }
    if constexpr (kContributors) {
      contributors = hn::IfThenElse(hn::RebindMask(di, added), hn::Set(di, place + *list + 1), contributors);
    }
    transmittance = hn::IfThenElse(open, passed, transmittance);
    if (hn::AllFalse(d, open)) {
      finished = true;
      break;
    }
  }
  hn::Store(passed, d, t.passed[block] + first);
  hn::Store(transmittance, d, t.transmittance[block] + first);
  hn::Store(red, d, t.color[0][block] + first);
  hn::Store(green, d, t.color[1][block] + first);
  hn::Store(blue, d, t.color[2][block] + first);
  if constexpr (kDepth) {
    hn::Store(depth, d, t.weighted_depth[block] + first);
    hn::Store(weights, d, t.weights[block] + first);
  }
  if constexpr (kContributors) hn::Store(contributors, di, t.contributors[block] + first);
  return finished;
}

template <bool kDepth, bool kContributors>
void BlendBlocks(const Limits& limits, int32_t place, Tile& t) {
  const size_t lanes = hn::Lanes(D());
  for (size_t block = 0; block < kBlocks; ++block) {
    if (t.finished[block] || t.list_sizes[block] == 0) continue;
    bool finished = true;
    for (size_t first = 0; first < kPixels; first += lanes) {
      finished &= BlendLanes<kDepth, kContributors>(limits, block, first, place, t);
    }
    t.finished[block] = finished;
  }
}

// Pixels outside the image start as stopped: they hold nothing up and are never stored.
void StartTile(int columns, int rows, Tile& t) {
  for (size_t block = 0; block < kBlocks; ++block) {
    const int x = static_cast<int>(block % kBlocksPerSide) * kBlock;
    const int y = static_cast<int>(block / kBlocksPerSide) * kBlock;
    t.finished[block] = x >= columns || y >= rows;
    for (int i = 0; i < static_cast<int>(kPixels); ++i) {
      const bool inside = x + i % kBlock < columns && y + i / kBlock < rows;
      t.passed[block][i] = inside ? 1.0f : 0.0f;
    }
  }
  std::fill_n(&t.transmittance[0][0], kBlocks * kPixels, 1.0f);
  std::fill_n(&t.color[0][0][0], 3 * kBlocks * kPixels, 0.0f);
  std::fill_n(&t.weighted_depth[0][0], kBlocks * kPixels, 0.0f);
  std::fill_n(&t.weights[0][0], kBlocks * kPixels, 0.0f);
  std::fill_n(&t.contributors[0][0], kBlocks * kPixels, 0);
}

// Background, alpha and expected depth, in place: color, passed := alpha, weighted_depth := depth.
void FinishPixels(const BlendParams& p, Tile& t) {
  const D d;
  const size_t lanes = hn::Lanes(d);
  for (size_t i = 0; i < kBlocks * kPixels; i += lanes) {
    const V transmittance = hn::Load(d, &t.transmittance[0][0] + i);
    for (size_t c = 0; c < 3; ++c) {
      float* color = &t.color[c][0][0] + i;
      hn::Store(hn::MulAdd(transmittance, hn::Set(d, p.background[c]), hn::Load(d, color)), d, color);
    }
    hn::Store(hn::Sub(hn::Set(d, 1.0f), transmittance), d, &t.passed[0][0] + i);
    // By the sum of the weights: it is 1 − T, which as a difference has few digits where little was seen.
    const V weights = hn::Load(d, &t.weights[0][0] + i);
    const M covered = hn::Gt(weights, hn::Zero(d));
    float* depth = &t.weighted_depth[0][0] + i;
    const V safe = hn::IfThenElse(covered, weights, hn::Set(d, 1.0f));
    hn::Store(hn::IfThenElseZero(covered, hn::Div(hn::Load(d, depth), safe)), d, depth);
  }
}

// Blocks to rows of the image.
template <typename T>
void StorePlane(const T (*blocks)[kPixels], int width, int columns, int rows, T* out) {
  for (int y = 0; y < rows; ++y) {
    const T(*in)[kPixels] = blocks + static_cast<size_t>(y / kBlock) * kBlocksPerSide;
    const int offset = y % kBlock * kBlock;
    T* to = out + int64_t{y} * width;
    int x = 0;
    for (; x + kBlock <= columns; x += kBlock, ++in) std::memcpy(to + x, *in + offset, kBlock * sizeof(T));
    for (int i = 0; x + i < columns; ++i) to[x + i] = (*in)[offset + i];
  }
}

template <typename T>
void FillPlane(T value, int width, int columns, int rows, T* out) {
  if (columns == kTile) {  // of a length known when compiling: a few stores instead of a call
    for (int y = 0; y < rows; ++y) {
      for (int x = 0; x < kTile; ++x) out[int64_t{y} * width + x] = value;
    }
  } else {
    for (int y = 0; y < rows; ++y) std::fill_n(out + int64_t{y} * width, columns, value);
  }
}

template <bool kDepth, bool kContributors>
void BlendTile(const BlendParams& p, int64_t tile) {
  const int tile_x = static_cast<int>(tile % p.tiles_x) * kTile, tile_y = static_cast<int>(tile / p.tiles_x) * kTile;
  const int columns = std::min(kTile, p.width - tile_x), rows = std::min(kTile, p.height - tile_y);
  const int64_t plane = int64_t{p.width} * p.height;
  const int64_t corner = int64_t{tile_y} * p.width + tile_x;
  const int64_t count = p.tile_offsets[tile + 1] - p.tile_offsets[tile];
  const int32_t* pairs = p.pairs + (p.tile_offsets[tile] - p.tile_offsets[p.first_tile]);
  int64_t evaluations = 0;
  if (count == 0) {
    for (int c = 0; c < 3; ++c) FillPlane(p.background[c], p.width, columns, rows, p.color + c * plane + corner);
    FillPlane(0.0f, p.width, columns, rows, p.alpha + corner);
    if constexpr (kDepth) FillPlane(0.0f, p.width, columns, rows, p.depth + corner);
    if (p.transmittance != nullptr) FillPlane(1.0f, p.width, columns, rows, p.transmittance + corner);
    if constexpr (kContributors) FillPlane(0, p.width, columns, rows, p.contributors + corner);
  } else {
    Tile t;
    StartTile(columns, rows, t);
    const Limits limits = {std::log2(p.min_alpha), p.max_alpha, p.min_transmittance};
    for (int64_t place = 0; place < count; place += static_cast<int64_t>(kBatch)) {
      const size_t n = static_cast<size_t>(std::min<int64_t>(kBatch, count - place));
      ReadBatch(p, pairs + place, n, tile_x, tile_y, t);
      ListBlocks(limits.log2_min_alpha, n, t);
      for (const size_t size : t.list_sizes) evaluations += static_cast<int64_t>(size);
      BlendBlocks<kDepth, kContributors>(limits, static_cast<int32_t>(place), t);
      if (std::all_of(t.finished, t.finished + kBlocks, [](bool f) { return f; })) break;
    }
    FinishPixels(p, t);
    for (int c = 0; c < 3; ++c) StorePlane(t.color[c], p.width, columns, rows, p.color + c * plane + corner);
    StorePlane(t.passed, p.width, columns, rows, p.alpha + corner);
    if constexpr (kDepth) StorePlane(t.weighted_depth, p.width, columns, rows, p.depth + corner);
    if (p.transmittance != nullptr) {
      StorePlane(t.transmittance, p.width, columns, rows, p.transmittance + corner);
    }
    if constexpr (kContributors) StorePlane(t.contributors, p.width, columns, rows, p.contributors + corner);
  }
  if (p.evaluations != nullptr) p.evaluations[tile] = evaluations;
}

void BlendRange(const BlendParams& p, int64_t first, int64_t last) {
  for (int64_t tile = first; tile < last; ++tile) {
    if (p.depth != nullptr) {
      p.contributors != nullptr ? BlendTile<true, true>(p, tile) : BlendTile<true, false>(p, tile);
    } else {
      p.contributors != nullptr ? BlendTile<false, true>(p, tile) : BlendTile<false, false>(p, tile);
    }
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

HWY_EXPORT(BlendRange);

void BlendCpu(const BlendParams& p) {
  // Tiles cost very differently, so tasks are small; empty ones are so cheap that one alone is not worth a task.
  constexpr int64_t kTilesPerTask = 4;
  ParallelFor(p.first_tile, p.last_tile, kTilesPerTask, [&p](int64_t first, int64_t last) {
    HWY_DYNAMIC_DISPATCH(BlendRange)(p, first, last);
  });
}

}  // namespace anchorsplat
#endif
