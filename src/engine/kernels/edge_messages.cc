#include "kernels/edge_messages.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/edge_messages.cc"
#include <hwy/foreach_target.h>  // compiles this file once per SIMD target
#include <hwy/highway.h>

#include "kernels/vector_math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {

void EdgeSumGelu(const EdgeSumParams& p) {
  const hn::CappedTag<float, 16> d;
  const auto lanes = static_cast<int64_t>(hn::Lanes(d));
  float* edge = p.edges;
  for (int64_t i = 0; i < p.points; ++i) {
    const float* own = p.own + i * p.channels;
    for (int64_t k = 0; k < p.neighbours; ++k, edge += p.channels) {
      const float* other = p.other + p.index[i * p.neighbours + k] * p.channels;
      for (int64_t c = 0; c < p.channels; c += lanes) {
        const auto sum = hn::Add(hn::Add(hn::LoadU(d, edge + c), hn::LoadU(d, own + c)), hn::LoadU(d, other + c));
        hn::StoreU(Gelu(d, sum), d, edge + c);
      }
    }
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

HWY_EXPORT(EdgeSumGelu);

void EdgeSumGeluCpu(const EdgeSumParams& p) { HWY_DYNAMIC_DISPATCH(EdgeSumGelu)(p); }

void EdgePoolCpu(const EdgePoolParams& p) {
  const float share = 1.0f / static_cast<float>(std::max<int64_t>(1, p.neighbours));
  for (int64_t i = 0; i < p.points; ++i) {
    float* maximum = p.out + i * p.out_stride;
    float* mean = maximum + p.channels;
    if (p.neighbours == 0) {
      std::fill(maximum, mean + p.channels, 0.0f);
      continue;
    }
    const float* edge = p.edges + i * p.neighbours * p.channels;
    std::copy(edge, edge + p.channels, maximum);
    std::copy(edge, edge + p.channels, mean);
    for (int64_t k = 1; k < p.neighbours; ++k) {
      edge += p.channels;
      for (int64_t c = 0; c < p.channels; ++c) {
        maximum[c] = std::max(maximum[c], edge[c]);
        mean[c] += edge[c];
      }
    }
    for (int64_t c = 0; c < p.channels; ++c) mean[c] *= share;
  }
}

}  // namespace anchorsplat
#endif
