#include "kernels/layer_norm.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/layer_norm.cc"
#include <hwy/foreach_target.h>  // compiles this file once per SIMD target
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void NormalizeRows(const LayerNormParams& p, int64_t begin, int64_t end) {
  const hn::ScalableTag<float> d;
  const auto lanes = static_cast<int64_t>(hn::Lanes(d));
  const int64_t channels = p.channels;
  const int64_t whole = channels / lanes * lanes;
  const float inverse = 1.0f / static_cast<float>(channels);
  for (int64_t row = begin; row < end; ++row) {
    const float* x = p.input + row * channels;
    auto sums = hn::Zero(d);
    float sum = 0;
    for (int64_t c = 0; c < whole; c += lanes) sums = hn::Add(sums, hn::LoadU(d, x + c));
    for (int64_t c = whole; c < channels; ++c) sum += x[c];
    const float mean = (hn::GetLane(hn::SumOfLanes(d, sums)) + sum) * inverse;
    // Two passes over a row in the L1 cache: a difference of squares would cancel.
    const auto means = hn::Set(d, mean);
    auto squares = hn::Zero(d);
    float square = 0;
    for (int64_t c = 0; c < whole; c += lanes) {
      const auto centred = hn::Sub(hn::LoadU(d, x + c), means);
      squares = hn::MulAdd(centred, centred, squares);
    }
    for (int64_t c = whole; c < channels; ++c) square += (x[c] - mean) * (x[c] - mean);
    const float variance = (hn::GetLane(hn::SumOfLanes(d, squares)) + square) * inverse;
    const float scale = 1.0f / std::sqrt(variance + p.epsilon);
    const auto scales = hn::Set(d, scale);
    float* out = p.out + row * channels;
    const float* add = p.add != nullptr ? p.add + row * channels : nullptr;
    for (int64_t c = 0; c < whole; c += lanes) {
      const auto normal = hn::Mul(hn::Sub(hn::LoadU(d, x + c), means), scales);
      auto y = hn::MulAdd(normal, hn::LoadU(d, p.weight + c), hn::LoadU(d, p.bias + c));
      if (add != nullptr) y = hn::Add(y, hn::LoadU(d, add + c));
      hn::StoreU(y, d, out + c);
    }
    for (int64_t c = whole; c < channels; ++c) {
      out[c] = (add != nullptr ? add[c] : 0.0f) + ((x[c] - mean) * scale * p.weight[c] + p.bias[c]);
    }
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

HWY_EXPORT(NormalizeRows);

void LayerNormCpu(const LayerNormParams& p) {
  const auto rows = HWY_DYNAMIC_DISPATCH(NormalizeRows);
  const int64_t grain = std::max<int64_t>(1, 32768 / std::max<int64_t>(1, p.channels));
  ParallelFor(0, p.rows, grain, [&](int64_t begin, int64_t end) { rows(p, begin, end); });
}

}  // namespace anchorsplat
#endif
