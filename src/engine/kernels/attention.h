#pragma once

#include <cstdint>

#include "kernels/patches.h"
#include "kernels/rounding.h"

namespace anchorsplat {

// Multi-head attention of PTv3: every point attends to the points of its patch (Wu et al. 2024, §4.3).
//
//   out_i = Σ_j softmax_j(scale · q_i·k_j) v_j      j over the patch of i, per head
//
// Products, softmax and sums are fused per patch and head, so scores never leave the cache.
struct AttentionParams {
  int64_t count;              // N points
  int64_t channels;           // C, a multiple of `heads`
  int64_t heads;              // H; a head owns C/H consecutive channels
  float scale;                // of the scores, usually (C/H)^(−1/2)
  const float* qkv;           // [N,3C] q | k | v of each point
  const int32_t* patch_rows;  // [PaddedCount(N, patch_size)] point in each slot of the padded order (patches.h)
  int64_t patch_size = kPatchSize;
  // Rounding of q, k, v, unnormalised probabilities and output. kHalf and kBFloat16 follow fused GPU attention, which
  // keeps scores, softmax and sums in fp32. Probabilities are relative to some score near the largest, so two
  // implementations agree up to rounding, not bitwise. kBFloat16 is fastest on processors with bfloat16 dot products
  // (bfloat16_attention.h).
  Rounding rounding = Rounding::kNone;
  // out
  float* out;  // [N,C]; must not overlap `qkv`
};
// The same bits for any number of threads. NaN and infinity affect only their patch and head.
void AttentionCpu(const AttentionParams& p);

}  // namespace anchorsplat
