#include "kernels/bfloat16_attention.h"

#if defined(__x86_64__)

// GCC 12 warns about uninitialized vectors that its own intrinsics pass for unused lanes (bug 105593).
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

#include <immintrin.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/buffer.h"
#include "core/per_thread.h"
#include "kernels/packed_weights.h"
#include "kernels/score_range.h"
#include "kernels/unroll.h"

#define ANCHORSPLAT_BF16 __attribute__((target("avx512f,avx512bw,avx512vl,avx512dq,avx512bf16")))
#define ANCHORSPLAT_BF16_INLINE ANCHORSPLAT_BF16 inline __attribute__((always_inline))
#define ANCHORSPLAT_BF16_NOINLINE ANCHORSPLAT_BF16 __attribute__((noinline))

namespace anchorsplat {

namespace {

// Queries occupy the lanes, as in attention.cc.
constexpr int kLanes = 16;
constexpr int kVectors = 4;  // of queries, a group
constexpr int kGroup = kVectors * kLanes;
constexpr int kKeyTile = 6;                   // keys whose scores are in registers at once; even, for pairs
constexpr int kDimTile = 4;                   // output channels whose sums are in registers at once
constexpr int64_t kKeyBlock = 20 * kKeyTile;  // its probabilities stay in the L1 cache
static_assert(kLargestGroup % kGroup == 0);

// Reused across tasks of a thread.
struct Scratch {
  Buffer<BFloat16Pair> keys;           // [keys, pairs of channels], padded with zeros to whole tiles
  Buffer<BFloat16Pair> values;         // [pairs of keys, channels], padded with zeros
  Buffer<BFloat16Pair> queries;        // [pairs of channels][group] of the current queries
  Buffer<BFloat16Pair> probabilities;  // [pairs of keys of a block][group], not normalised
  Buffer<float> sums;                  // [channels][group] Σ probability · value
};

// Scores of a group of queries as exponents of 2, with shifts and totals.
struct Group {
  const BFloat16Pair* queries;
  int64_t pairs;  // of channels
  float scale;
  float shifts[kGroup];
  float totals[kGroup];  // Σ probability
};

ANCHORSPLAT_BF16_INLINE __m512bh Pairs(const BFloat16Pair* p) { return (__m512bh)_mm512_loadu_si512(p); }
ANCHORSPLAT_BF16_INLINE __m512bh Broadcast(BFloat16Pair p) {
  return (__m512bh)_mm512_set1_epi32(static_cast<int32_t>(p));
}

// Loads the first `count` of 16 floats, zeros for the rest.
ANCHORSPLAT_BF16_INLINE __m512 LoadFirst(const float* values, int64_t count) {
  const auto mask = static_cast<__mmask16>(count >= kLanes ? 0xffffu : (1u << count) - 1);
  return _mm512_maskz_loadu_ps(mask, values);
}

// Products of kKeyTile keys with a group of queries.
ANCHORSPLAT_BF16_INLINE void Products(const BFloat16Pair* keys, const BFloat16Pair* queries, int64_t pairs,
                                      __m512 (&products)[kKeyTile][kVectors]) {
  ANCHORSPLAT_UNROLL
  for (int j = 0; j < kKeyTile; ++j) {
    ANCHORSPLAT_UNROLL
    for (int v = 0; v < kVectors; ++v) products[j][v] = _mm512_setzero_ps();
  }
  for (int64_t c = 0; c < pairs; ++c) {
    __m512bh q[kVectors];
    ANCHORSPLAT_UNROLL
    for (int v = 0; v < kVectors; ++v) q[v] = Pairs(queries + c * kGroup + v * kLanes);
    ANCHORSPLAT_UNROLL
    for (int j = 0; j < kKeyTile; ++j) {
      const __m512bh k = Broadcast(keys[j * pairs + c]);
      ANCHORSPLAT_UNROLL
      for (int v = 0; v < kVectors; ++v) products[j][v] = _mm512_dpbf16_ps(products[j][v], k, q[v]);
    }
  }
}

// The largest score of each query over every `step`-th tile of keys. May miss NaN; the probabilities do not.
ANCHORSPLAT_BF16_NOINLINE void LargestScores(const BFloat16Pair* keys, int64_t key_count, int64_t step, Group& g) {
  __m512 best[kVectors];
  const __m512 scale = _mm512_set1_ps(g.scale);
  ANCHORSPLAT_UNROLL
  for (int v = 0; v < kVectors; ++v) best[v] = _mm512_set1_ps(-3.0e38f);
  for (int64_t j0 = 0; j0 < key_count; j0 += step * kKeyTile) {
    __m512 products[kKeyTile][kVectors];
    Products(keys + j0 * g.pairs, g.queries, g.pairs, products);
    ANCHORSPLAT_UNROLL
    for (int j = 0; j < kKeyTile; ++j) {
      if (j0 + j >= key_count) break;
      ANCHORSPLAT_UNROLL
      for (int v = 0; v < kVectors; ++v) best[v] = _mm512_max_ps(best[v], _mm512_mul_ps(products[j][v], scale));
    }
  }
  ANCHORSPLAT_UNROLL
  for (int v = 0; v < kVectors; ++v) _mm512_storeu_ps(g.shifts + v * kLanes, best[v]);
}

// 2^x with the upper half rounded to the nearest bfloat16, ties up; the lower half is meaningless. 2^f for f = x − ⌊x⌋
// is the minimax polynomial of degree 3 (Remez, relative weight, error 7.5e-5) and lies in [1, 2], where half a
// bfloat16 unit is 2^-8. Its constant term includes that, so truncation rounds.
template <ScoreRange kRange>
ANCHORSPLAT_BF16_INLINE __m512 Exp2ToCut(__m512 x) {
  constexpr int kFloor = 0x09;  // round down, suppress exceptions
  const __m512 f = _mm512_reduce_ps(x, kFloor);
  __m512 p = _mm512_set1_ps(0.07802452264047964f);
  p = _mm512_fmadd_ps(p, f, _mm512_set1_ps(0.22606715542748304f));
  p = _mm512_fmadd_ps(p, f, _mm512_set1_ps(0.6958335404947528f));
  p = _mm512_fmadd_ps(p, f, _mm512_set1_ps(0.9999252185627154f + 0x1p-8f));
  if constexpr (kRange == ScoreRange::kBounded) return _mm512_scalef_ps(p, x);
  // No subnormals; NaN stays.
  return _mm512_maskz_scalef_ps(_mm512_cmp_ps_mask(x, _mm512_set1_ps(-126.0f), _CMP_NLT_UQ), p, x);
}

// Probabilities 2^(score − shift) of a block of keys.
template <ScoreRange kRange>
ANCHORSPLAT_BF16_NOINLINE void Probabilities(const BFloat16Pair* keys, int64_t key_count, const Group& g,
                                             BFloat16Pair* __restrict probabilities) {
  constexpr __mmask32 kSecond = 0xaaaaaaaau;  // of each pair
  const __m512 scale = _mm512_set1_ps(g.scale);
  for (int64_t j0 = 0; j0 < key_count; j0 += kKeyTile) {
    __m512 products[kKeyTile][kVectors];
    Products(keys + j0 * g.pairs, g.queries, g.pairs, products);
    ANCHORSPLAT_UNROLL
    for (int j = 0; j < kKeyTile; j += 2) {
      if (j0 + j >= key_count) break;
      const bool alone = j0 + j + 1 == key_count;
      ANCHORSPLAT_UNROLL
      for (int v = 0; v < kVectors; ++v) {
        const __m512 shift = _mm512_loadu_ps(g.shifts + v * kLanes);
        const __m512 first = Exp2ToCut<kRange>(_mm512_fmsub_ps(products[j][v], scale, shift));
        const __m512 second = Exp2ToCut<kRange>(_mm512_fmsub_ps(products[j + 1][v], scale, shift));
        const __m512i lower = _mm512_srli_epi32(_mm512_castps_si512(first), 16);
        const __m512i pair = alone ? lower : _mm512_mask_blend_epi16(kSecond, lower, _mm512_castps_si512(second));
        _mm512_storeu_si512(probabilities + (j0 + j) / 2 * kGroup + v * kLanes, pair);
      }
    }
  }
}

// sums[c] += Σ_j value[j,c] · probability[j] over pairs of keys for kDimTile channels; totals += Σ_j probability[j].
template <bool kTotals>
ANCHORSPLAT_BF16_NOINLINE void Accumulate(const BFloat16Pair* __restrict probabilities,
                                          const BFloat16Pair* __restrict values, int64_t key_pairs, int64_t depth,
                                          float* __restrict sums, float* __restrict totals) {
  const __m512bh ones = Broadcast(0x3f803f80u);
  __m512 sum[kDimTile][kVectors];
  __m512 total[kVectors];
  ANCHORSPLAT_UNROLL
  for (int v = 0; v < kVectors; ++v) {
    if constexpr (kTotals) total[v] = _mm512_loadu_ps(totals + v * kLanes);
    ANCHORSPLAT_UNROLL
    for (int i = 0; i < kDimTile; ++i) sum[i][v] = _mm512_loadu_ps(sums + i * kGroup + v * kLanes);
  }
  for (int64_t j = 0; j < key_pairs; ++j) {
    __m512bh p[kVectors];
    ANCHORSPLAT_UNROLL
    for (int v = 0; v < kVectors; ++v) {
      p[v] = Pairs(probabilities + j * kGroup + v * kLanes);
      if constexpr (kTotals) total[v] = _mm512_dpbf16_ps(total[v], p[v], ones);
    }
    ANCHORSPLAT_UNROLL
    for (int i = 0; i < kDimTile; ++i) {
      const __m512bh x = Broadcast(values[j * depth + i]);
      ANCHORSPLAT_UNROLL
      for (int v = 0; v < kVectors; ++v) sum[i][v] = _mm512_dpbf16_ps(sum[i][v], x, p[v]);
    }
  }
  ANCHORSPLAT_UNROLL
  for (int v = 0; v < kVectors; ++v) {
    if constexpr (kTotals) _mm512_storeu_ps(totals + v * kLanes, total[v]);
    ANCHORSPLAT_UNROLL
    for (int i = 0; i < kDimTile; ++i) _mm512_storeu_ps(sums + i * kGroup + v * kLanes, sum[i][v]);
  }
}

// Packs a row of `width` floats into `pairs` pairs, `stride` apart. Returns its sum of squares before rounding.
ANCHORSPLAT_BF16_INLINE float PackChannels(const float* row, int64_t width, int64_t pairs, int64_t stride,
                                           BFloat16Pair* out) {
  __m512 squares = _mm512_setzero_ps();
  for (int64_t c = 0; c < pairs; c += kLanes / 2) {
    const __m512 x = LoadFirst(row + 2 * c, width - 2 * c);
    squares = _mm512_fmadd_ps(x, x, squares);
    alignas(32) BFloat16Pair packed[kLanes / 2];
    _mm256_store_si256(reinterpret_cast<__m256i*>(packed), (__m256i)_mm512_cvtneps_pbh(x));
    const int64_t here = std::min<int64_t>(kLanes / 2, pairs - c);
    for (int64_t i = 0; i < here; ++i) out[(c + i) * stride] = packed[i];
  }
  return _mm512_reduce_add_ps(squares);
}

// Packs two rows as one pair per channel.
ANCHORSPLAT_BF16_INLINE void PackRows(const float* first, const float* second, int64_t width, BFloat16Pair* out) {
  for (int64_t c = 0; c < width; c += kLanes) {
    const __m256i a = (__m256i)_mm512_cvtneps_pbh(LoadFirst(first + c, width - c));
    const __m256i b = (__m256i)_mm512_cvtneps_pbh(LoadFirst(second + c, width - c));
    const __m512i pairs = _mm512_or_si512(_mm512_cvtepu16_epi32(a), _mm512_slli_epi32(_mm512_cvtepu16_epi32(b), 16));
    const auto mask = static_cast<__mmask16>(width - c >= kLanes ? 0xffffu : (1u << (width - c)) - 1);
    _mm512_mask_storeu_epi32(out + c, mask, pairs);
  }
}

// Packs a patch's keys and values. Returns the length of the longest key, or NaN.
ANCHORSPLAT_BF16_NOINLINE float PackPatch(const AttentionParams& p, const AttentionTask& task, int64_t pairs,
                                          int64_t depth, Scratch& s) {
  const int64_t width = p.channels / p.heads;
  const auto row = [&](int64_t j, int64_t part) {
    return p.qkv + (int64_t{3} * p.patch_rows[task.patch_begin + j] + part) * p.channels + task.head * width;
  };
  const int64_t padded = (task.keys + kKeyTile - 1) / kKeyTile * kKeyTile;
  s.keys.assign(static_cast<size_t>(padded * pairs), 0);
  s.values.assign(static_cast<size_t>((task.keys + 1) / 2 * depth), 0);
  float longest = 0;
  bool ordered = true;  // no NaN
  for (int64_t j = 0; j < task.keys; ++j) {
    const float squares = PackChannels(row(j, 1), width, pairs, 1, s.keys.data() + j * pairs);
    ordered = ordered && squares == squares;
    longest = std::max(longest, squares);
  }
  const Buffer<float> zeros = task.keys % 2 != 0 ? Buffer<float>(static_cast<size_t>(width), 0.0f) : Buffer<float>();
  for (int64_t j = 0; j < task.keys; j += 2) {
    const float* second = j + 1 < task.keys ? row(j + 1, 2) : zeros.data();
    PackRows(row(j, 2), second, width, s.values.data() + j / 2 * depth);
  }
  return ordered ? std::sqrt(longest) : std::numeric_limits<float>::quiet_NaN();
}

// Writes the outputs of a group of `count` queries, rounded.
ANCHORSPLAT_BF16_NOINLINE void WriteMeans(const AttentionParams& p, const AttentionTask& task, const int32_t* rows,
                                          int64_t count, const float* totals, float* sums) {
  const int64_t width = p.channels / p.heads;
  ANCHORSPLAT_UNROLL
  for (int v = 0; v < kVectors; ++v) {
    const __m512 total = _mm512_loadu_ps(totals + v * kLanes);
    for (int64_t c = 0; c < width; ++c) {
      float* sum = sums + c * kGroup + v * kLanes;
      const __m256i rounded = (__m256i)_mm512_cvtneps_pbh(_mm512_div_ps(_mm512_loadu_ps(sum), total));
      _mm512_storeu_si512(sum, _mm512_slli_epi32(_mm512_cvtepu16_epi32(rounded), 16));
    }
  }
  for (int64_t i = 0; i < count; ++i) {
    float* out = p.out + rows[i] * p.channels + task.head * width;
    for (int64_t c = 0; c < width; ++c) out[c] = sums[c * kGroup + i];
  }
}

ANCHORSPLAT_BF16_NOINLINE void AttendGroup(const AttentionParams& p, const AttentionTask& task, int64_t pairs,
                                           int64_t depth, float longest_key, int64_t query, Scratch& s) {
  const int64_t width = p.channels / p.heads;
  const int64_t count = std::min<int64_t>(kGroup, task.last - query);
  const int32_t* rows = p.patch_rows + task.patch_begin + query;
  Group g{
      .queries = s.queries.data(), .pairs = pairs, .scale = p.scale * 1.44269504088896341f, .shifts = {}, .totals = {}};
  std::fill(s.queries.begin(), s.queries.end(), 0);
  // Rounding to bfloat16 makes the bounds at most 0.8 % too small; ChooseShifts has room for that.
  float bounds[kGroup] = {};
  for (int64_t i = 0; i < count; ++i) {
    const float* q = p.qkv + int64_t{3} * rows[i] * p.channels + task.head * width;
    const float squares = PackChannels(q, width, pairs, kGroup, s.queries.data() + i);
    bounds[i] = std::sqrt(squares) * std::abs(g.scale) * longest_key;
  }
  const int64_t tiles = (task.keys + kKeyTile - 1) / kKeyTile;
  constexpr int64_t kProbes = 10;  // tiles
  const ScoreRange range = ChooseShifts(Rounding::kBFloat16, kGroup, bounds, g.shifts, [&](bool all) {
    LargestScores(s.keys.data(), task.keys, all ? 1 : std::max<int64_t>(1, tiles / kProbes), g);
  });
  std::fill(s.sums.begin(), s.sums.end(), 0.0f);
  for (int64_t j = 0; j < task.keys; j += kKeyBlock) {
    const int64_t keys = std::min(kKeyBlock, task.keys - j);
    const BFloat16Pair* block = s.keys.data() + j * pairs;
    if (range == ScoreRange::kBounded) {
      Probabilities<ScoreRange::kBounded>(block, keys, g, s.probabilities.data());
    } else {
      Probabilities<ScoreRange::kAny>(block, keys, g, s.probabilities.data());
    }
    const BFloat16Pair* values = s.values.data() + j / 2 * depth;
    Accumulate<true>(s.probabilities.data(), values, (keys + 1) / 2, depth, s.sums.data(), g.totals);
    for (int64_t c = kDimTile; c < depth; c += kDimTile) {
      Accumulate<false>(s.probabilities.data(), values + c, (keys + 1) / 2, depth, s.sums.data() + c * kGroup, nullptr);
    }
  }
  WriteMeans(p, task, rows, count, g.totals, s.sums.data());
}

}  // namespace

void AttendBFloat16Dot(const AttentionParams& p, const AttentionTask& task) {
  auto& scratch = PerThread<Scratch>();
  const int64_t width = p.channels / p.heads;
  const int64_t pairs = (width + 1) / 2;
  const int64_t depth = (width + kDimTile - 1) / kDimTile * kDimTile;
  scratch.queries.resize(static_cast<size_t>(pairs * kGroup));
  scratch.sums.resize(static_cast<size_t>(depth * kGroup));
  scratch.probabilities.resize(static_cast<size_t>(kKeyBlock / 2 * kGroup));
  const float longest_key = PackPatch(p, task, pairs, depth, scratch);
  for (int64_t query = task.first; query < task.last; query += kGroup) {
    AttendGroup(p, task, pairs, depth, longest_key, query, scratch);
  }
}

}  // namespace anchorsplat

#else

namespace anchorsplat {

void AttendBFloat16Dot(const AttentionParams&, const AttentionTask&) {}

}  // namespace anchorsplat

#endif
