#pragma once

#include <cstdint>

namespace anchorsplat {

// Fine to coarse: maximum over each cluster's points, then inference BatchNorm and GELU.
struct ClusterMaxParams {
  int64_t fine_count;      // N
  int64_t coarse_count;    // M; no cluster is empty
  int64_t channels;        // C
  const float* input;      // [N,C]
  const int32_t* cluster;  // [N] 0 … M−1
  const float* scale;      // [C] weight / √(running variance + ε)
  const float* shift;      // [C] bias − running mean · scale
  // out
  float* out;  // [M,C] gelu(max · scale + shift)
};
void ClusterMaxCpu(const ClusterMaxParams& p);

// Coarse to fine: out[i] = skip[i] + coarse[cluster[i]].
struct ClusterAddParams {
  int64_t fine_count;      // N
  int64_t channels;        // C
  const float* skip;       // [N,C]
  const float* coarse;     // [M,C]
  const int32_t* cluster;  // [N]
  // out
  float* out;  // [N,C]; may be `skip`
};
void ClusterAddCpu(const ClusterAddParams& p);

}  // namespace anchorsplat
