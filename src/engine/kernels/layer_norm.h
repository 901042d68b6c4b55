#pragma once

#include <cstdint>

namespace anchorsplat {

inline constexpr double kLayerNormEpsilon = 1e-5;  // of both networks

// LayerNorm of each row: out = (add or 0) + (x − mean) / √(variance + ε) · weight + bias, with variance by 1/C.
struct LayerNormParams {
  int64_t rows;         // N
  int64_t channels;     // C
  const float* input;   // [N,C]
  const float* weight;  // [C]
  const float* bias;    // [C]
  float epsilon = 1e-5f;
  const float* add = nullptr;  // [N,C] or null; may be `out`
  // out
  float* out;  // [N,C]; may be `input`
};
// The same bits for any number of threads.
void LayerNormCpu(const LayerNormParams& p);

}  // namespace anchorsplat
