#include "render/blend.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/parallel.h"
#include "render/piece.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/blend.cc"
// foreach_target compiles this file once per instruction set, so it must come first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include "render/tile_batch-inl.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {
namespace {

constexpr size_t kBatch = 256;

// State of a tile: the batch and its pixels.
struct Tile : TileBatch<kBatch> {
  bool finished[kBlocks];  // no pixel of the block can change any more

  // `passed` keeps shrinking after a pixel stopped, `transmittance` does not; see BlendLanes.
  alignas(64) float passed[kBlocks][kPixels], transmittance[kBlocks][kPixels];
  alignas(64) float color[3][kBlocks][kPixels], weighted_depth[kBlocks][kPixels], weights[kBlocks][kPixels];
  alignas(64) int32_t contributors[kBlocks][kPixels];
};

struct Limits {
  float log2_min_alpha, max_alpha, min_transmittance;
};

// Composites a block's list onto a register of its pixels, from pixel `first` on. Returns whether all of them are
// finished. `place`: index of the batch in the tile's list.
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
    const V dx = hn::Sub(pixel_x, hn::Set(d, t.at[j][0])), dy = hn::Sub(pixel_y, hn::Set(d, t.at[j][1]));
    const V log2_alpha = Log2Alpha(t, j, dx, dy);
    const M seen = hn::Ge(log2_alpha, log2_min_alpha);
    const V alpha = hn::Min(Exp2(log2_alpha), max_alpha);
    const V weight = hn::Mul(alpha, passed);
    const V next = hn::NegMulAdd(passed, alpha, passed);
    // A pixel stops at the first `next` that is too small. `passed` takes that step nevertheless and stays too small,
    // which avoids a mask of stopped pixels and keeps the dependency chain between Gaussians short.
    passed = hn::IfThenElse(seen, next, passed);
    const M open = hn::Gt(passed, min_transmittance);
    const M added = hn::And(seen, open);
    const V w = hn::IfThenElseZero(added, weight);
    red = hn::MulAdd(w, hn::Set(d, t.seen[j][0]), red);
    green = hn::MulAdd(w, hn::Set(d, t.seen[j][1]), green);
    blue = hn::MulAdd(w, hn::Set(d, t.seen[j][2]), blue);
    if constexpr (kDepth) {
      depth = hn::MulAdd(w, hn::Set(d, t.seen[j][3]), depth);
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

// Pixels outside the image start as stopped; they delay nothing and are never stored.
void StartTile(int columns, int rows, Tile& t) {
  for (size_t block = 0; block < kBlocks; ++block) {
    const int x = static_cast<int>(block % kBlocksPerSide) * kBlock;
    const int y = static_cast<int>(block / kBlocksPerSide) * kBlock;
    t.finished[block] = x >= columns || y >= rows;
    if (x + kBlock <= columns && y + kBlock <= rows) {  // nearly always
      std::fill_n(t.passed[block], kPixels, 1.0f);
      continue;
    }
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

// Adds the background and computes alpha and expected depth, in place: color, passed := alpha, weighted_depth := depth.
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
    // Divided by the sum of weights, which equals 1 − T but keeps precision where little is visible.
    const V weights = hn::Load(d, &t.weights[0][0] + i);
    const M covered = hn::Gt(weights, hn::Zero(d));
    float* depth = &t.weighted_depth[0][0] + i;
    const V safe = hn::IfThenElse(covered, weights, hn::Set(d, 1.0f));
    hn::Store(hn::IfThenElseZero(covered, hn::Div(hn::Load(d, depth), safe)), d, depth);
  }
}

// Stores blocks to rows of the image.
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
  if (columns == kTile) {  // compile-time length: a few stores instead of a call
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
      ReadBatch(p.projected, pairs + place, n, tile_x, tile_y, t);
      const int64_t left = count - place - static_cast<int64_t>(n);
      Fetch(p.projected, pairs + place + n, static_cast<size_t>(std::min<int64_t>(kBatch, left)));
      ListBlocks(limits.log2_min_alpha, n, t.finished, t);
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
  const int64_t pairs = p.tile_offsets[p.last_tile] - p.tile_offsets[p.first_tile];
  ParallelFor(p.first_tile, p.last_tile, TilesPerTask(p.last_tile - p.first_tile, pairs),
              [&p](int64_t first, int64_t last) {
                HWY_DYNAMIC_DISPATCH(BlendRange)
                (p, first, last);
              });
}

}  // namespace anchorsplat
#endif
