#pragma once

#include <cstdint>

#include "kernels/attention.h"

namespace anchorsplat {

// Queries [first, last) of a patch, for one head.
struct AttentionTask {
  int64_t patch_begin;  // first slot
  int64_t keys;         // slots of the patch
  int64_t first;        // slots of the queries, within the patch
  int64_t last;
  int64_t head;
};

// Patches are split at multiples of this; every implementation's group size divides it.
inline constexpr int64_t kLargestGroup = 64;

// Attention with Rounding::kBFloat16 on the processor's bfloat16 dot products. Requires UsesBFloat16Dot()
// (bfloat16_tile.h). Differs from the widened arithmetic in three ways: products flush subnormals; exponentials are
// good to 7.5e-5, then rounded to nearest (ties up) to a bfloat16's 2^-9; the rounded probabilities are divided by
// their own sum, so weights add up to one. Results agree to 2^-8 (Σ_j softmax_j |v_j| + |out|), as for any two
// implementations that round probabilities relative to different scores.
void AttendBFloat16Dot(const AttentionParams& p, const AttentionTask& task);

}  // namespace anchorsplat
