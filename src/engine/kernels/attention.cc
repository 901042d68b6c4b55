#include "kernels/attention.h"

#include <algorithm>
#include <cmath>

#include "core/buffer.h"
#include "core/parallel.h"
#include "core/per_thread.h"
#include "kernels/bfloat16_attention.h"
#include "kernels/bfloat16_tile.h"
#include "kernels/score_range.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/attention.cc"
#include <hwy/foreach_target.h>  // compiles this file once per SIMD target
#include <hwy/highway.h>

#include "kernels/unroll.h"
#include "kernels/vector_math-inl.h"

#ifndef ANCHORSPLAT_ATTENTION_ONCE
#define ANCHORSPLAT_ATTENTION_ONCE
namespace anchorsplat {

// Reused across tasks of a thread.
struct AttentionScratch {
  Buffer<float> keys;           // [keys, depth], padded with zeros to whole tiles
  Buffer<float> values;         // [keys, depth]
  Buffer<float> queries;        // [depth][group] of the current queries, scaled
  Buffer<float> probabilities;  // [keys of a block][group], not normalised
  Buffer<float> sums;           // [depth][group] Σ probability · value
};

}  // namespace anchorsplat
#endif

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {

// Queries occupy the lanes: each softmax stays within its lane, and keys and values are broadcast.
using GroupTag = hn::CappedTag<float, 16>;
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL
inline constexpr int kVectors = 4;  // of queries, a group
inline constexpr int kKeyTile = 6;  // keys whose scores are in registers at once
inline constexpr int kDimTile = 4;  // output channels whose sums are in registers at once
#elif HWY_TARGET == HWY_NEON
inline constexpr int kVectors = 4;
inline constexpr int kKeyTile = 6;
inline constexpr int kDimTile = 4;
#else
inline constexpr int kVectors = 2;
inline constexpr int kKeyTile = 4;
inline constexpr int kDimTile = 4;
#endif
inline constexpr int kLanes = static_cast<int>(HWY_MIN(HWY_LANES(float), size_t{16}));
inline constexpr int kGroup = kVectors * kLanes;
static_assert(kLargestGroup % kGroup == 0);
inline constexpr int64_t kKeyBlock = 10 * kKeyTile;  // its probabilities stay in the L1 cache

using V = hn::VFromD<GroupTag>;

// Scores of kKeyTile keys for a group of queries, minus `shift`.
HWY_INLINE void Scores(const float* HWY_RESTRICT keys, const float* HWY_RESTRICT queries, int64_t depth,
                       const V (&shift)[kVectors], V (&scores)[kKeyTile][kVectors]) {
  const GroupTag d;
  ANCHORSPLAT_UNROLL
  for (int v = 0; v < kVectors; ++v) {
    ANCHORSPLAT_UNROLL
    for (int j = 0; j < kKeyTile; ++j) scores[j][v] = shift[v];
  }
  for (int64_t c = 0; c < depth; ++c) {
    V q[kVectors];
    ANCHORSPLAT_UNROLL
    for (int v = 0; v < kVectors; ++v) q[v] = hn::LoadU(d, queries + c * kGroup + v * kLanes);
    ANCHORSPLAT_UNROLL
    for (int j = 0; j < kKeyTile; ++j) {
      const V k = hn::Set(d, keys[j * depth + c]);
      ANCHORSPLAT_UNROLL
      for (int v = 0; v < kVectors; ++v) scores[j][v] = hn::MulAdd(k, q[v], scores[j][v]);
    }
  }
}

// The largest score of each query over every `step`-th tile of keys. May miss NaN; the probabilities do not.
HWY_NOINLINE void LargestScores(const float* keys, int64_t key_count, int64_t step, const float* queries, int64_t depth,
                                float* HWY_RESTRICT largest) {
  const GroupTag d;
  V best[kVectors];
  V zero[kVectors];
  ANCHORSPLAT_UNROLL
  for (int v = 0; v < kVectors; ++v) {
    best[v] = hn::Set(d, -3.0e38f);
    zero[v] = hn::Zero(d);
  }
  for (int64_t j0 = 0; j0 < key_count; j0 += step * kKeyTile) {
    V scores[kKeyTile][kVectors];
    Scores(keys + j0 * depth, queries, depth, zero, scores);
    ANCHORSPLAT_UNROLL
    for (int j = 0; j < kKeyTile; ++j) {
      if (j0 + j >= key_count) break;
      ANCHORSPLAT_UNROLL
      for (int v = 0; v < kVectors; ++v) best[v] = hn::Max(best[v], scores[j][v]);
    }
  }
  ANCHORSPLAT_UNROLL
  for (int v = 0; v < kVectors; ++v) hn::StoreU(best[v], d, largest + v * kLanes);
}

// Probabilities exp2(score − shift) of a block of keys; adds their sums over the keys to `total`.
template <ScoreRange kRange, Rounding kRounding>
HWY_NOINLINE void Probabilities(const float* keys, int64_t key_count, const float* queries, int64_t depth,
                                const float* HWY_RESTRICT shifts, float* HWY_RESTRICT probabilities,
                                float* HWY_RESTRICT totals) {
  const GroupTag d;
  V total[kVectors];
  V shift[kVectors];
  ANCHORSPLAT_UNROLL
  for (int v = 0; v < kVectors; ++v) {
    total[v] = hn::LoadU(d, totals + v * kLanes);
    shift[v] = hn::Neg(hn::LoadU(d, shifts + v * kLanes));
  }
  for (int64_t j0 = 0; j0 < key_count; j0 += kKeyTile) {
    V scores[kKeyTile][kVectors];
    Scores(keys + j0 * depth, queries, depth, shift, scores);
    ANCHORSPLAT_UNROLL
    for (int j = 0; j < kKeyTile; ++j) {
      if (j0 + j >= key_count) break;
      ANCHORSPLAT_UNROLL
      for (int v = 0; v < kVectors; ++v) {
        const V p = kRange == ScoreRange::kBounded ? Exp2Bounded(d, scores[j][v]) : Exp2(d, scores[j][v]);
        total[v] = hn::Add(total[v], p);
        hn::StoreU(Round<kRounding>(d, p), d, probabilities + (j0 + j) * kGroup + v * kLanes);
      }
    }
  }
  ANCHORSPLAT_UNROLL
  for (int v = 0; v < kVectors; ++v) hn::StoreU(total[v], d, totals + v * kLanes);
}

// sums[c] += Σ_j value[j,c] · probability[j] over a block of keys.
HWY_NOINLINE void Accumulate(const float* HWY_RESTRICT probabilities, const float* HWY_RESTRICT values,
                             int64_t key_count, int64_t depth, float* HWY_RESTRICT sums) {
  const GroupTag d;
  for (int64_t c = 0; c < depth; c += kDimTile) {
    V sum[kDimTile][kVectors];
    ANCHORSPLAT_UNROLL
    for (int i = 0; i < kDimTile; ++i) {
      ANCHORSPLAT_UNROLL
      for (int v = 0; v < kVectors; ++v) sum[i][v] = hn::LoadU(d, sums + (c + i) * kGroup + v * kLanes);
    }
    for (int64_t j = 0; j < key_count; ++j) {
      V p[kVectors];
      ANCHORSPLAT_UNROLL
      for (int v = 0; v < kVectors; ++v) p[v] = hn::LoadU(d, probabilities + j * kGroup + v * kLanes);
      ANCHORSPLAT_UNROLL
      for (int i = 0; i < kDimTile; ++i) {
        const V x = hn::Set(d, values[j * depth + c + i]);
        ANCHORSPLAT_UNROLL
        for (int v = 0; v < kVectors; ++v) sum[i][v] = hn::MulAdd(x, p[v], sum[i][v]);
      }
    }
    ANCHORSPLAT_UNROLL
    for (int i = 0; i < kDimTile; ++i) {
      ANCHORSPLAT_UNROLL
      for (int v = 0; v < kVectors; ++v) hn::StoreU(sum[i][v], d, sums + (c + i) * kGroup + v * kLanes);
    }
  }
}

// Rounds `count` values, a multiple of kLanes, and multiplies them by `factor`.
template <Rounding kRounding>
void RoundAndScale(float* values, int64_t count, float factor) {
  const GroupTag d;
  for (int64_t i = 0; i < count; i += kLanes) {
    const V rounded = Round<kRounding>(d, hn::LoadU(d, values + i));
    hn::StoreU(hn::Mul(rounded, hn::Set(d, factor)), d, values + i);
  }
}

// Sum of squares of a key; `depth` is a multiple of four, summed in independent chains.
float Squares(const float* key, int64_t depth) {
  static_assert(kDimTile % 4 == 0);
  float sums[4] = {};
  for (int64_t c = 0; c < depth; c += 4) {
    for (int i = 0; i < 4; ++i) sums[i] += key[c + i] * key[c + i];
  }
  return sums[0] + sums[1] + (sums[2] + sums[3]);
}

template <Rounding kRounding>
void AttendGroup(const AttentionParams& p, const AttentionTask& task, int64_t depth, float longest_key, int64_t query,
                 AttentionScratch& s) {
  const GroupTag d;
  const int64_t width = p.channels / p.heads;
  const int64_t count = std::min<int64_t>(kGroup, task.last - query);
  const int32_t* rows = p.patch_rows + task.patch_begin + query;
  // Scores become exponents of 2.
  const float scale = p.scale * 1.44269504088896341f;
  std::fill(s.queries.begin(), s.queries.end(), 0.0f);
  for (int64_t i = 0; i < count; ++i) {
    const float* q = p.qkv + int64_t{3} * rows[i] * p.channels + task.head * width;
    for (int64_t c = 0; c < width; ++c) s.queries[static_cast<size_t>(c * kGroup + i)] = q[c];
  }
  RoundAndScale<kRounding>(s.queries.data(), depth * kGroup, scale);
  alignas(64) float bounds[kGroup];
  for (int i = 0; i < kGroup; i += kLanes) {
    V squares = hn::Zero(d);
    for (int64_t c = 0; c < width; ++c) {
      const V q = hn::LoadU(d, s.queries.data() + c * kGroup + i);
      squares = hn::MulAdd(q, q, squares);
    }
    hn::StoreU(hn::Mul(hn::Sqrt(squares), hn::Set(d, longest_key)), d, bounds + i);
  }
  alignas(64) float shifts[kGroup];
  alignas(64) float totals[kGroup] = {};
  const int64_t tiles = (task.keys + kKeyTile - 1) / kKeyTile;
  constexpr int64_t kProbes = 10;  // tiles
  const ScoreRange range = ChooseShifts(kRounding, kGroup, bounds, shifts, [&](bool all) HWY_ATTR {
    LargestScores(s.keys.data(), task.keys, all ? 1 : std::max<int64_t>(1, tiles / kProbes), s.queries.data(), depth,
                  shifts);
  });
  std::fill(s.sums.begin(), s.sums.end(), 0.0f);
  for (int64_t j = 0; j < task.keys; j += kKeyBlock) {
    const int64_t keys = std::min(kKeyBlock, task.keys - j);
    const float* block = s.keys.data() + j * depth;
    if (range == ScoreRange::kBounded) {
      Probabilities<ScoreRange::kBounded, kRounding>(block, keys, s.queries.data(), depth, shifts,
                                                     s.probabilities.data(), totals);
    } else {
      Probabilities<ScoreRange::kAny, kRounding>(block, keys, s.queries.data(), depth, shifts, s.probabilities.data(),
                                                 totals);
    }
    Accumulate(s.probabilities.data(), s.values.data() + j * depth, keys, depth, s.sums.data());
  }
  for (int64_t c = 0; c < width; ++c) {
    ANCHORSPLAT_UNROLL
    for (int v = 0; v < kVectors; ++v) {
      float* sum = s.sums.data() + c * kGroup + v * kLanes;
      const V mean = hn::Div(hn::LoadU(d, sum), hn::LoadU(d, totals + v * kLanes));
      hn::StoreU(Round<kRounding>(d, mean), d, sum);
    }
  }
  for (int64_t i = 0; i < count; ++i) {
    float* out = p.out + rows[i] * p.channels + task.head * width;
    for (int64_t c = 0; c < width; ++c) out[c] = s.sums[static_cast<size_t>(c * kGroup + i)];
  }
}

template <Rounding kRounding>
void AttendRounded(const AttentionParams& p, const AttentionTask& task, AttentionScratch& s) {
  const int64_t width = p.channels / p.heads;
  const int64_t depth = (width + kDimTile - 1) / kDimTile * kDimTile;
  const int64_t padded = (task.keys + kKeyTile - 1) / kKeyTile * kKeyTile;
  const int64_t floats = (padded * depth + kLanes - 1) / kLanes * kLanes;
  s.keys.resize(static_cast<size_t>(floats));
  s.values.resize(static_cast<size_t>(floats));
  s.queries.resize(static_cast<size_t>(depth * kGroup));
  s.sums.resize(static_cast<size_t>(depth * kGroup));
  s.probabilities.resize(static_cast<size_t>(kKeyBlock * kGroup));
  for (int64_t j = 0; j < task.keys; ++j) {
    float* key = s.keys.data() + j * depth;
    float* value = s.values.data() + j * depth;
    const float* k = p.qkv + (int64_t{3} * p.patch_rows[task.patch_begin + j] + 1) * p.channels + task.head * width;
    const float* v = k + p.channels;
    std::fill(std::copy_n(k, width, key), key + depth, 0.0f);
    std::fill(std::copy_n(v, width, value), value + depth, 0.0f);
  }
  std::fill(s.keys.begin() + task.keys * depth, s.keys.end(), 0.0f);
  std::fill(s.values.begin() + task.keys * depth, s.values.end(), 0.0f);
  if constexpr (kRounding != Rounding::kNone) {
    RoundAndScale<kRounding>(s.keys.data(), floats, 1);
    RoundAndScale<kRounding>(s.values.data(), floats, 1);
  }
  float longest = 0;
  bool ordered = true;  // no NaN
  for (int64_t j = 0; j < task.keys; ++j) {
    const float squares = Squares(s.keys.data() + j * depth, depth);
    ordered = ordered && squares == squares;
    longest = std::max(longest, squares);
  }
  const float longest_key = ordered ? std::sqrt(longest) : NAN;
  for (int64_t query = task.first; query < task.last; query += kGroup) {
    AttendGroup<kRounding>(p, task, depth, longest_key, query, s);
  }
}

void Attend(const AttentionParams& p, const AttentionTask& task, AttentionScratch& scratch) {
  switch (p.rounding) {
    case Rounding::kNone:
      return AttendRounded<Rounding::kNone>(p, task, scratch);
    case Rounding::kHalf:
      return AttendRounded<Rounding::kHalf>(p, task, scratch);
    case Rounding::kBFloat16:
      return AttendRounded<Rounding::kBFloat16>(p, task, scratch);
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

HWY_EXPORT(Attend);

void AttentionCpu(const AttentionParams& p) {
  if (p.count <= 0) return;
  const auto attend = HWY_DYNAMIC_DISPATCH(Attend);
  const bool dot = p.rounding == Rounding::kBFloat16 && UsesBFloat16Dot();
  const int64_t padded = PaddedCount(p.count, p.patch_size);
  const int64_t patch = std::min(padded, p.patch_size);
  const int64_t patches = padded / patch;
  // Whole patches are cheapest. They are split (at multiples of every group, so results do not change) only if threads
  // would otherwise be idle.
  const auto whole_groups = [](int64_t n) { return (n + kLargestGroup - 1) / kLargestGroup * kLargestGroup; };
  int64_t chunk = whole_groups(patch);
  const int64_t wanted = 4 * static_cast<int64_t>(ThreadCount());
  while (chunk > 128 && patches * p.heads * ((patch + chunk - 1) / chunk) < wanted) chunk = whole_groups(chunk / 2);
  const int64_t chunks = (patch + chunk - 1) / chunk;
  ParallelFor(0, patches * p.heads * chunks, 1, [&](int64_t begin, int64_t end) {
    auto& scratch = PerThread<AttentionScratch>();
    for (int64_t index = begin; index < end; ++index) {
      const int64_t slot = index / (p.heads * chunks) * patch;
      const int64_t own = std::min(patch, p.count - slot);  // a last patch borrows the rest
      const int64_t first = index % chunks * chunk;
      if (first >= own) continue;
      const AttentionTask task = {.patch_begin = slot,
                                  .keys = patch,
                                  .first = first,
                                  .last = std::min(own, first + chunk),
                                  .head = index / chunks % p.heads};
      if (dot) {
        AttendBFloat16Dot(p, task);
      } else {
        attend(p, task, scratch);
      }
    }
  });
}

}  // namespace anchorsplat
#endif
