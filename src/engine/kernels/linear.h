#pragma once

#include <cstdint>

#include "kernels/packed_weights.h"

namespace anchorsplat {

enum class Activation : uint8_t { kNone, kRelu, kGelu };

// A linear layer, out = activation(x · Wᵀ + b) + residual, in fp32 or with weights and inputs rounded to bfloat16
// (packed_weights.h).
struct LinearParams {
  int64_t rows;        // N
  const float* input;  // [N, weights.inputs()], rows `input_stride` floats apart
  int64_t input_stride;
  const PackedWeights* weights;  // one tap
  Activation activation = Activation::kNone;
  const float* residual = nullptr;  // [N, weights.outputs()] or null, rows `output_stride` apart; may be `out`
  // out
  float* out;             // [N, weights.outputs()]; must not overlap `input`
  int64_t output_stride;  // floats
};
// The same bits for any number of threads; the last bit may differ between SIMD widths.
void LinearCpu(const LinearParams& p);
// The same for rows without gaps.
void LinearCpu(int64_t rows, const float* input, const PackedWeights& weights, float* out,
               Activation activation = Activation::kNone, const float* residual = nullptr);

}  // namespace anchorsplat
