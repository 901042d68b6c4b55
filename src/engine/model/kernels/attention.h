#pragma once

#include <cstdint>

#include "model/kernels/patches.h"
#include "model/kernels/rounding.h"

namespace anchorsplat {

// Multi-head attention of PTv3: every point attends to the points of its patch of the order (Wu et al. 2024, §4.3).
//
//   out_i = Σ_j softmax_j(scale · q_i·k_j) v_j      j over the patch of i, per head
//
// The products, the softmax and their sums are fused per patch and head, so that scores never leave the cache.
struct AttentionParams {
  int64_t count;              // N points
  int64_t channels;           // C, a multiple of `heads`
  int64_t heads;              // H; a head owns C/H consecutive channels
  float scale;                // of the scores, usually (C/H)^(−1/2)
  const float* qkv;           // [N,3C] q | k | v of each point
  const int32_t* patch_rows;  // [PaddedCount(N, patch_size)] point in each slot of the padded order (patches.h)
  int64_t patch_size = kPatchSize;
  // What q, k, v, the probabilities before their normalisation, and the output are rounded to. kHalf and kBFloat16
  // follow the arithmetic of fused attention on a GPU, whose scores, softmax and sums stay in fp32. There too the
  // probabilities are relative to some score near the largest, so two implementations agree up to the rounding, not to
  // the bit. kBFloat16 is the fastest of the three where the processor multiplies bfloat16 itself
  // (bfloat16_attention.h).
  Rounding rounding = Rounding::kNone;
  // out
  float* out;  // [N,C]; must not overlap `qkv`
};
// The same bits for any number of threads. NaN and infinity stay in their patch and head.
void AttentionCpu(const AttentionParams& p);

}  // namespace anchorsplat
