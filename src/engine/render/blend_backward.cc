#include "render/blend_backward.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/parallel.h"
#include "render/piece.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/blend_backward.cc"
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

constexpr size_t kBatch = 128;
constexpr size_t kGroup = 32;      // Gaussians of a block per group, between the two steps of AddBlock
constexpr size_t kSumsAhead = 16;  // prefetch distance of sums, in Gaussians
constexpr size_t kSums = 16;       // floats per Gaussian of a batch: one sum per feature

// The sums over a block's pixels are a small matrix product. Each (Gaussian, pixel) has two factors, q and the weight w
// = α·T, and each pixel has features independent of the Gaussian: even ones, multiplied by q, are 1, x, y, x², xy, y²
// about the middle of the tile; odd ones, multiplied by w, are ∂L/∂C. q and w are adjacent in memory, so one
// instruction fills a register with both.
enum Feature : size_t { kOne = 0, kX = 2, kY = 4, kXX = 6, kXY = 8, kYY = 10, kRed = 1, kGreen = 3, kBlue = 5 };

// State of a tile: the batch, its sums, and its pixels by block.
struct Tile : TileBatch<kBatch> {
  bool finished[kBlocks];  // no gradient, or all Gaussians of the batch lie behind

  alignas(64) float features[kBlocks][kPixels][kSums];  // of pixels in the order of StorePairs
  size_t order[kPixels];
  alignas(64) float sums[kBatch + 3][kSums];
  bool touched[kBatch];  // the Gaussian has sums

  alignas(64) float color_gradient[3][kBlocks][kPixels];
  alignas(64) float transmittance[kBlocks][kPixels];  // T behind the next Gaussian
  alignas(64) float behind[kBlocks][kPixels];         // S of BlendBackwardParams
  alignas(64) int32_t contributors[kBlocks][kPixels];
  int32_t last[kBlocks];  // largest of its contributors, 0 if no pixel has a gradient

  // Per group: q and w of every pixel alternating, the Gaussian's index, and whether they are not all 0. Three dummy
  // Gaussians follow the group, whose sums are not read.
  alignas(64) float factors[kGroup + 3][2 * kPixels];
  size_t members[kGroup + 3];
  bool added[kGroup];

  // Only for absolute sums: of |∂L/∂mean2d|/(2 ln 2), x and y, over the pixels of each lane.
  alignas(64) float absolute[kBatch][2][kLanesAtMost];
};

constexpr float kMiddle = 0.5f * kTile;

// Stores two numbers per pixel side by side. This permutes the pixels of a register (see PixelOrder), which does not
// matter and would cost shuffles to undo.
HWY_INLINE void StorePairs(V first, V second, float* to) {
  const D d;
#if HWY_TARGET == HWY_SCALAR
  hn::StoreU(first, d, to);
  hn::StoreU(second, d, to + 1);
#else
  hn::StoreU(hn::InterleaveLower(d, first, second), d, to);
  hn::StoreU(hn::InterleaveUpper(d, first, second), d, to + hn::Lanes(d));
#endif
}

// order[k]: the pixel whose numbers StorePairs puts at index k.
void PixelOrder(size_t* order) {
  const D d;
  const size_t lanes = hn::Lanes(d);
  alignas(64) float pixels[2 * kLanesAtMost];
  for (size_t first = 0; first < kPixels; first += lanes) {
    const V pixel = hn::Iota(d, static_cast<float>(first));
    StorePairs(pixel, pixel, pixels);
    for (size_t k = 0; k < lanes; ++k) order[first + k] = static_cast<size_t>(pixels[2 * k]);
  }
}

// Tile-independent data.
void Prepare(Tile& t) {
  PixelOrder(t.order);
  for (size_t k = 0; k < 3; ++k) {
    std::fill_n(t.factors[kGroup + k], 2 * kPixels, 0.0f);
    std::fill_n(t.sums[kBatch + k], kSums, 0.0f);
    t.members[kGroup + k] = kBatch + k;
  }
  for (size_t block = 0; block < kBlocks; ++block) {
    for (size_t k = 0; k < kPixels; ++k) {
      const size_t i = t.order[k];
      const float x = kPixelOffsets.x[i] + static_cast<float>(block % kBlocksPerSide * kBlock) - kMiddle;
      const float y = kPixelOffsets.y[i] + static_cast<float>(block / kBlocksPerSide * kBlock) - kMiddle;
      float* f = t.features[block][k];
      std::fill_n(f, kSums, 0.0f);
      f[kOne] = 1;
      f[kX] = x;
      f[kY] = y;
      f[kXX] = x * x;
      f[kXY] = x * y;
      f[kYY] = y * y;
    }
  }
}

// A register filled with a repeated pair of floats.
HWY_INLINE V RepeatPair(const float* pair) {
  const D d;
#if HWY_TARGET == HWY_SCALAR
  return hn::Set(d, *pair);
#else
  double both;
  std::memcpy(&both, pair, sizeof(both));
  return hn::BitCast(d, hn::Set(hn::Repartition<double, D>(), both));
#endif
}

// sums += features · factors for four Gaussians of the group.
HWY_INLINE void AddSums(size_t block, const uint8_t* four, Tile& t) {
  const D d;
  const size_t lanes = hn::Lanes(d);
  const size_t k0 = four[0], k1 = four[1], k2 = four[2], k3 = four[3];
  for (size_t f = 0; f < kSums; f += lanes) {
    const size_t odd = lanes == 1 ? f % 2 : 0;  // a one-lane register takes only its half of the pair
    const float *factors0 = t.factors[k0] + odd, *factors1 = t.factors[k1] + odd, *factors2 = t.factors[k2] + odd,
                *factors3 = t.factors[k3] + odd;
    V sum0 = hn::Zero(d), sum1 = hn::Zero(d), sum2 = hn::Zero(d), sum3 = hn::Zero(d);
    for (size_t i = 0; i < kPixels; ++i) {
      const V feature = hn::Load(d, t.features[block][i] + f);
      sum0 = hn::MulAdd(RepeatPair(factors0 + 2 * i), feature, sum0);
      sum1 = hn::MulAdd(RepeatPair(factors1 + 2 * i), feature, sum1);
      sum2 = hn::MulAdd(RepeatPair(factors2 + 2 * i), feature, sum2);
      sum3 = hn::MulAdd(RepeatPair(factors3 + 2 * i), feature, sum3);
    }
    float *to0 = t.sums[t.members[k0]] + f, *to1 = t.sums[t.members[k1]] + f, *to2 = t.sums[t.members[k2]] + f,
          *to3 = t.sums[t.members[k3]] + f;
    hn::Store(hn::Add(hn::Load(d, to0), sum0), d, to0);
    hn::Store(hn::Add(hn::Load(d, to1), sum1), d, to1);
    hn::Store(hn::Add(hn::Load(d, to2), sum2), d, to2);
    hn::Store(hn::Add(hn::Load(d, to3), sum3), d, to3);
  }
}

struct Limits {
  float log2_min_alpha, max_alpha;
};

// Computes the factors of the group's `count` Gaussians, farthest first, for a register of the block's pixels from
// `first` on. Returns for each whether a pixel added it.
template <bool kAbsolute>
HWY_INLINE void EvaluateLanes(const Limits& limits, size_t block, size_t first, size_t count, int32_t place, Tile& t) {
  const D d;
  const DI di;
  const V pixel_x =
      hn::Add(hn::Load(d, kPixelOffsets.x + first), hn::Set(d, static_cast<float>(block % kBlocksPerSide * kBlock)));
  const V pixel_y =
      hn::Add(hn::Load(d, kPixelOffsets.y + first), hn::Set(d, static_cast<float>(block / kBlocksPerSide * kBlock)));
  const V one = hn::Set(d, 1.0f), log2_min_alpha = hn::Set(d, limits.log2_min_alpha);
  const V max_alpha = hn::Set(d, limits.max_alpha);
  const V red = hn::Load(d, t.color_gradient[0][block] + first);
  const V green = hn::Load(d, t.color_gradient[1][block] + first);
  const V blue = hn::Load(d, t.color_gradient[2][block] + first);
  const VI contributors = hn::Load(di, t.contributors[block] + first);
  V transmittance = hn::Load(d, t.transmittance[block] + first);
  V behind = hn::Load(d, t.behind[block] + first);
  for (size_t k = 0; k < count; ++k) {
    const size_t j = t.members[k];
    const V dx = hn::Sub(pixel_x, hn::Set(d, t.at[j][0])), dy = hn::Sub(pixel_y, hn::Set(d, t.at[j][1]));
    const V log2_alpha = Log2Alpha(t, j, dx, dy);
    const VI own_place = hn::Set(di, place + static_cast<int32_t>(j));
    const M added = hn::And(hn::Ge(log2_alpha, log2_min_alpha), hn::RebindMask(d, hn::Gt(contributors, own_place)));
    float* factors = t.factors[k] + 2 * first;
    if (hn::AllFalse(d, added)) {
      if (hn::Lanes(d) < kPixels) std::fill_n(factors, 2 * hn::Lanes(d), 0.0f);  // other pixels may have added it
      continue;
    }
    t.added[k] = true;
    const V uncapped = Exp2(log2_alpha);
    const V alpha = hn::IfThenElseZero(added, hn::Min(uncapped, max_alpha));
    const V inverse = hn::Div(one, hn::Sub(one, alpha));  // 1 if nothing was added
    transmittance = hn::Mul(transmittance, inverse);
    const V weight = hn::Mul(alpha, transmittance);
    const V along = hn::MulAdd(red, hn::Set(d, t.seen[j][0]),
                               hn::MulAdd(green, hn::Set(d, t.seen[j][1]), hn::Mul(blue, hn::Set(d, t.seen[j][2]))));
    const V own = hn::Mul(weight, along);
    const V q = hn::NegMulAdd(behind, hn::Mul(alpha, inverse), own);
    behind = hn::Add(behind, own);
    const V free_q = hn::IfThenElseZero(hn::Le(uncapped, max_alpha), q);  // also 0 if nothing was added
    StorePairs(free_q, weight, factors);
    if constexpr (kAbsolute) {
      // ∂L/∂mean2d = 2 ln 2·Wᵀ q·(u, v) as in ProjectBackwardCpu, but per pixel.
      const V u_xx = hn::Set(d, t.shape[j][0]), u_xy = hn::Set(d, t.shape[j][1]), u_yy = hn::Set(d, t.shape[j][2]);
      const V u = hn::MulAdd(u_xx, dx, hn::Mul(u_xy, dy)), v = hn::Mul(u_yy, dy);
      const V along_x = hn::Mul(free_q, hn::Mul(u_xx, u));
      const V along_y = hn::Mul(free_q, hn::MulAdd(u_xy, u, hn::Mul(u_yy, v)));
      float *to_x = t.absolute[j][0], *to_y = t.absolute[j][1];
      hn::Store(hn::Add(hn::Load(d, to_x), hn::Abs(along_x)), d, to_x);
      hn::Store(hn::Add(hn::Load(d, to_y), hn::Abs(along_y)), d, to_y);
    }
  }
  hn::Store(transmittance, d, t.transmittance[block] + first);
  hn::Store(behind, d, t.behind[block] + first);
}

// Processes a block's list from the back in groups: first the contributions per pixel, then the sums over pixels.
template <bool kAbsolute>
void AddBlock(const Limits& limits, size_t block, int32_t place, Tile& t) {
  const int32_t* list = t.lists[block];
  size_t left = t.list_sizes[block];
  while (left > 0 && place + list[left - 1] >= t.last[block]) --left;
  while (left > 0) {
    const size_t count = std::min(left, kGroup);
    for (size_t k = 0; k < count; ++k) t.members[k] = static_cast<size_t>(list[left - 1 - k]);
    std::fill_n(t.added, count, false);
    for (size_t first = 0; first < kPixels; first += hn::Lanes(D())) {
      EvaluateLanes<kAbsolute>(limits, block, first, count, place, t);
    }
    uint8_t group[kGroup + 3];
    size_t found = 0;
    for (size_t k = 0; k < count; ++k) {
      group[found] = static_cast<uint8_t>(k);
      found += t.added[k];
      t.touched[t.members[k]] |= t.added[k];
    }
    if (found > 0) {
      // The three dummies complete the last four.
      for (size_t k = 0; k < 3; ++k) group[found + k] = static_cast<uint8_t>(kGroup + k);
      for (size_t k = 0; k < found; k += 4) AddSums(block, group + k, t);
    }
    left -= count;
  }
}

// Loads rows of the image into blocks; outside of [x0, x1) × [y0, y1) of the tile becomes `outside`.
template <typename T>
void LoadPlane(const T* plane, int width, int x0, int y0, int x1, int y1, T outside, T (*blocks)[kPixels]) {
  if (x0 > 0 || y0 > 0 || x1 < kTile || y1 < kTile) std::fill_n(&blocks[0][0], kBlocks * kPixels, outside);
  for (int y = y0; y < y1; ++y) {
    const T* from = plane + int64_t{y} * width;
    T(*to)[kPixels] = blocks + static_cast<size_t>(y / kBlock) * kBlocksPerSide;
    const int offset = y % kBlock * kBlock;
    if (x0 == 0 && x1 == kTile) {
      for (size_t b = 0; b < kBlocksPerSide; ++b) {
        std::memcpy(to[b] + offset, from + b * kBlock, kBlock * sizeof(T));
      }
    } else {
      for (int x = x0; x < x1; ++x) to[x / kBlock][offset + x % kBlock] = from[x];
    }
  }
}

// Values derived from a block's pixels.
HWY_INLINE void StartBlock(const BlendBackwardParams& p, size_t block, double* background_gradient, Tile& t) {
  const D d;
  const DI di;
  const V zero = hn::Zero(d);
  V background[3] = {zero, zero, zero};
  VI last = hn::Zero(di);
  bool flat = true;
  for (size_t first = 0; first < kPixels; first += hn::Lanes(d)) {
    const auto load = [&](const float(*plane)[kPixels]) HWY_ATTR { return hn::Load(d, plane[block] + first); };
    const V red = load(t.color_gradient[0]), green = load(t.color_gradient[1]), blue = load(t.color_gradient[2]);
    const V transmittance = load(t.transmittance), alpha = load(t.behind);
    // Written so that NaN is not flat.
    const M flat_color = hn::And(hn::And(hn::Eq(red, zero), hn::Eq(green, zero)), hn::Eq(blue, zero));
    flat = flat && hn::AllTrue(d, hn::And(flat_color, hn::Eq(alpha, zero)));
    last = hn::Max(last, hn::Load(di, t.contributors[block] + first));
    background[0] = hn::MulAdd(transmittance, red, background[0]);
    background[1] = hn::MulAdd(transmittance, green, background[1]);
    background[2] = hn::MulAdd(transmittance, blue, background[2]);
    const V behind = hn::MulAdd(
        hn::Set(d, p.background[0]), red,
        hn::MulAdd(hn::Set(d, p.background[1]), green, hn::MulSub(hn::Set(d, p.background[2]), blue, alpha)));
    hn::Store(hn::Mul(transmittance, behind), d, t.behind[block] + first);
  }
  for (size_t c = 0; c < 3; ++c) {
    background_gradient[c] += static_cast<double>(hn::GetLane(hn::SumOfLanes(d, background[c])));
  }
  t.last[block] = flat ? 0 : hn::GetLane(hn::MaxOfLanes(di, last));
  if (t.last[block] == 0) return;
  for (size_t k = 0; k < kPixels; ++k) {
    const size_t i = t.order[k];
    float* features = t.features[block][k];
    features[kRed] = t.color_gradient[0][block][i];
    features[kGreen] = t.color_gradient[1][block][i];
    features[kBlue] = t.color_gradient[2][block][i];
  }
}

// Loads the pixels and adds the background's gradient. Returns 1 + the last relevant index of the tile's list.
int32_t StartTile(const BlendBackwardParams& p, int tile_x, int tile_y, double* background_gradient, Tile& t) {
  // Pixels outside the image or box have gradient 0, which makes everything 0.
  const int x0 = std::max(0, p.box.x0 - tile_x), x1 = std::min(kTile, p.box.x1 - tile_x);
  const int y0 = std::max(0, p.box.y0 - tile_y), y1 = std::min(kTile, p.box.y1 - tile_y);
  const int64_t plane = int64_t{p.width} * p.height;
  const int64_t corner = int64_t{tile_y} * p.width + tile_x;
  for (int c = 0; c < 3; ++c) {
    LoadPlane(p.color_gradient + c * plane + corner, p.width, x0, y0, x1, y1, 0.0f, t.color_gradient[c]);
  }
  LoadPlane(p.transmittance + corner, p.width, x0, y0, x1, y1, 1.0f, t.transmittance);
  LoadPlane(p.contributors + corner, p.width, x0, y0, x1, y1, 0, t.contributors);
  if (p.alpha_gradient != nullptr) {
    LoadPlane(p.alpha_gradient + corner, p.width, x0, y0, x1, y1, 0.0f, t.behind);
  } else {
    std::fill_n(&t.behind[0][0], kBlocks * kPixels, 0.0f);
  }
  int32_t last_of_tile = 0;
  for (size_t block = 0; block < kBlocks; ++block) {
    StartBlock(p, block, background_gradient, t);
    last_of_tile = std::max(last_of_tile, t.last[block]);
  }
  return last_of_tile;
}

// Converts sums about the middle of the tile to those of BlendGradient.
HWY_INLINE void Whiten(const Tile& t, size_t j, BlendGradient& to) {
  const float* s = t.sums[j];
  const float xx = t.shape[j][0], xy = t.shape[j][1], yy = t.shape[j][2];
  const float dx = kMiddle - t.at[j][0], dy = kMiddle - t.at[j][1];
  // u and v of the middle. Where a pixel adds the Gaussian, u and v are at most 2.9; a tile is 16 px wide and the
  // factors at most 1.6 per pixel. So all terms are small even if the mean is far away.
  const float u = xx * dx + xy * dy, v = yy * dy;
  // Sums of q times the offset from the middle, in u and v.
  const float ou = xx * s[kX] + xy * s[kY], ov = yy * s[kY];
  const float ouu = xx * xx * s[kXX] + 2 * xx * xy * s[kXY] + xy * xy * s[kYY];
  const float ouv = yy * (xx * s[kXY] + xy * s[kYY]);
  const float ovv = yy * yy * s[kYY];
  to.q = s[kOne];
  to.qu = ou + u * s[kOne];
  to.qv = ov + v * s[kOne];
  to.quu = ouu + u * (2 * ou + u * s[kOne]);
  to.quv = ouv + v * ou + u * (ov + v * s[kOne]);
  to.qvv = ovv + v * (2 * ov + v * s[kOne]);
  to.rgb[0] = s[kRed];
  to.rgb[1] = s[kGreen];
  to.rgb[2] = s[kBlue];
}

// Stores the absolute sums of Gaussian j of the batch to `to` [2].
HWY_INLINE void WriteAbsolute(const Tile& t, size_t j, float* to) {
  constexpr float kTwoLn2 = 1.38629436f;
  for (size_t a = 0; a < 2; ++a) {
    float sum = 0;
    for (size_t lane = 0; lane < hn::Lanes(D()); ++lane) sum += t.absolute[j][a][lane];
    to[a] = kTwoLn2 * sum;
  }
}

HWY_INLINE void FetchSums(const BlendGradient* to) {
  hwy::Prefetch(&to->q);
  hwy::Prefetch(&to->rgb[2]);  // most span two cache lines
}

// Adds the batch's sums to the Gaussians'.
template <bool kAbsolute>
HWY_INLINE void AddToGradients(const BlendBackwardParams& p, const int32_t* rows, size_t n, const Tile& t) {
  for (size_t j = 0; j < std::min(n, kSumsAhead); ++j) hwy::Prefetch(p.gradients + rows[j]);
  for (size_t j = 0; j < n; ++j) {
    if (j + kSumsAhead < n) FetchSums(p.gradients + rows[j + kSumsAhead]);
    if (!t.touched[j]) continue;
    BlendGradient own;
    Whiten(t, j, own);
    p.gradients[rows[j]] += own;
    if constexpr (kAbsolute) {
      float absolute[2];
      WriteAbsolute(t, j, absolute);
      for (size_t a = 0; a < 2; ++a) p.absolute[2 * int64_t{rows[j]} + static_cast<int64_t>(a)] += absolute[a];
    }
  }
}

// Stores the batch's sums in the slots of its Gaussians for this tile.
template <bool kAbsolute>
HWY_INLINE void WriteSlots(const BlendBackwardParams& p, const int32_t* rows, size_t n, int64_t tile, const Tile& t) {
  const int32_t tile_x = static_cast<int32_t>(tile % p.tiles_x), tile_y = static_cast<int32_t>(tile / p.tiles_x);
  size_t found = 0;
  uint8_t which[kBatch];
  int64_t slots[kBatch];
  for (size_t j = 0; j < n; ++j) {
    which[found] = static_cast<uint8_t>(j);
    found += t.touched[j];
  }
  for (size_t k = 0; k < found; ++k) {
    const int32_t row = rows[which[k]];
    const ProjectedGaussian& g = p.projected[row];
    slots[k] = p.slot_starts[row / kProjectChunk] + g.slot + int64_t{tile_y - g.tile_y0} * g.tiles_across +
               (tile_x - g.tile_x0);
    FetchSums(p.sums + slots[k]);
  }
  for (size_t k = 0; k < found; ++k) {
    Whiten(t, which[k], p.sums[slots[k]]);
    p.touched[slots[k]] = 1;
    if constexpr (kAbsolute) WriteAbsolute(t, which[k], p.absolute + 2 * slots[k]);
  }
}

template <bool kAbsolute>
void BackwardTile(const BlendBackwardParams& p, int64_t tile, Tile& t) {
  const int tile_x = static_cast<int>(tile % p.tiles_x) * kTile, tile_y = static_cast<int>(tile / p.tiles_x) * kTile;
  const int64_t list_begin = p.tile_offsets[tile] - p.tile_offsets[p.first_tile];
  double* background_gradient = p.tile_backgrounds + 3 * (tile - p.first_tile);
  std::fill_n(background_gradient, 3, 0.0);
  const bool outside = p.box.empty() || p.box.x0 >= tile_x + kTile || p.box.x1 <= tile_x ||
                       p.box.y0 >= tile_y + kTile || p.box.y1 <= tile_y;
  const int32_t last = outside ? 0 : StartTile(p, tile_x, tile_y, background_gradient, t);
  const Limits limits = {std::log2(p.min_alpha), p.max_alpha};
  constexpr int32_t kStep = static_cast<int32_t>(kBatch);
  for (int32_t place = (last - 1) / kStep * kStep; last > 0 && place >= 0; place -= kStep) {
    const size_t n = static_cast<size_t>(std::min(kStep, last - place));
    const int32_t* rows = p.pairs + list_begin + place;
    ReadBatch(p.projected, rows, n, tile_x, tile_y, t);
    Fetch(p.projected, p.pairs + list_begin + std::max(place - kStep, 0), static_cast<size_t>(place == 0 ? 0 : kStep));
    for (size_t block = 0; block < kBlocks; ++block) t.finished[block] = t.last[block] <= place;
    ListBlocks(limits.log2_min_alpha, n, t.finished, t);
    std::fill_n(&t.sums[0][0], n * kSums, 0.0f);
    std::fill_n(t.touched, n, false);
    if constexpr (kAbsolute) std::fill_n(&t.absolute[0][0][0], n * 2 * kLanesAtMost, 0.0f);
    for (size_t block = 0; block < kBlocks; ++block) {
      if (t.list_sizes[block] > 0) AddBlock<kAbsolute>(limits, block, place, t);
    }
    if (p.gradients != nullptr) {
      AddToGradients<kAbsolute>(p, rows, n, t);
    } else {
      WriteSlots<kAbsolute>(p, rows, n, tile, t);
    }
  }
}

void BackwardRange(const BlendBackwardParams& p, int64_t first, int64_t last) {
  Tile t;
  Prepare(t);
  if (p.absolute != nullptr) {
    for (int64_t tile = first; tile < last; ++tile) BackwardTile<true>(p, tile, t);
  } else {
    for (int64_t tile = first; tile < last; ++tile) BackwardTile<false>(p, tile, t);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

HWY_EXPORT(BackwardRange);

void BlendBackwardCpu(const BlendBackwardParams& p) {
  const int64_t tiles = p.last_tile - p.first_tile;
  const int64_t pairs = p.tile_offsets[p.last_tile] - p.tile_offsets[p.first_tile];
  // One task if they share the gradients.
  const int64_t tiles_per_task = p.gradients != nullptr ? tiles : TilesPerTask(tiles, pairs);
  ParallelFor(p.first_tile, p.last_tile, tiles_per_task, [&p](int64_t first, int64_t last) {
    HWY_DYNAMIC_DISPATCH(BackwardRange)(p, first, last);
  });
  for (int64_t tile = 0; tile < tiles; ++tile) {
    for (int c = 0; c < 3; ++c) p.background_gradient[c] += p.tile_backgrounds[3 * tile + c];
  }
}

}  // namespace anchorsplat
#endif
