#pragma once

#include <cstdint>

#include "model/kernels/attention.h"

namespace anchorsplat {

// Queries [first, last) of a patch, one head.
struct AttentionTask {
  int64_t patch_begin;  // first slot
  int64_t keys;         // slots of the patch
  int64_t first;        // slots of the queries, within the patch
  int64_t last;
  int64_t head;
};

// Patches are split at multiples of this, which every way to compute them works off a divisor of at a time.
inline constexpr int64_t kLargestGroup = 64;

// Attention with Rounding::kBFloat16 by the processor's own dot products of bfloat16 pairs. Three things differ from
// the widened arithmetic: products flush subnormals; exponentials are good to 7.5e-5 and rounded to nearest with ties
// up, to a bfloat16's 2^-9 in all; and it is the rounded probabilities whose sum they are divided by, so that the
// weights of the values add up to one. What comes out of the two agrees to 2^-8 (Σ_j softmax_j |v_j| + |out|), as any
// two do that round probabilities relative to different scores. Only where UsesBFloat16Dot() (bfloat16_tile.h).
void AttendBFloat16Dot(const AttentionParams& p, const AttentionTask& task);

}  // namespace anchorsplat
