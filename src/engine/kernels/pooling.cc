#include "kernels/pooling.h"

#include <algorithm>

#include "core/buffer.h"
#include "core/parallel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/pooling.cc"
#include <hwy/foreach_target.h>  // compiles this file once per SIMD target
#include <hwy/highway.h>

#include "kernels/vector_math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {

// gelu(x · scale + shift) in place; the tail goes through a padded copy.
void AffineGelu(int64_t channels, const float* scale, const float* shift, float* x) {
  const hn::CappedTag<float, 16> d;
  const auto lanes = static_cast<int64_t>(hn::Lanes(d));
  const int64_t whole = channels / lanes * lanes;
  const auto apply = [&](const float* a, const float* b, float* at) HWY_ATTR {
    hn::StoreU(Gelu(d, hn::MulAdd(hn::LoadU(d, at), hn::LoadU(d, a), hn::LoadU(d, b))), d, at);
  };
  for (int64_t c = 0; c < whole; c += lanes) apply(scale + c, shift + c, x + c);
  if (whole < channels) {
    alignas(64) float rest[3][16] = {};
    std::copy(scale + whole, scale + channels, rest[0]);
    std::copy(shift + whole, shift + channels, rest[1]);
    std::copy(x + whole, x + channels, rest[2]);
    apply(rest[0], rest[1], rest[2]);
    std::copy(rest[2], rest[2] + (channels - whole), x + whole);
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

HWY_EXPORT(AffineGelu);

void ClusterMaxCpu(const ClusterMaxParams& p) {
  // Points of each cluster, one cluster after the other.
  Buffer<int32_t> begin, members(static_cast<size_t>(p.fine_count));
  begin.assign(static_cast<size_t>(p.coarse_count) + 2, 0);
  for (int64_t i = 0; i < p.fine_count; ++i) ++begin[static_cast<size_t>(p.cluster[i]) + 2];
  for (size_t c = 2; c < begin.size(); ++c) begin[c] += begin[c - 1];
  for (int64_t i = 0; i < p.fine_count; ++i) {
    members[static_cast<size_t>(begin[static_cast<size_t>(p.cluster[i]) + 1]++)] = static_cast<int32_t>(i);
  }
  const auto affine_gelu = HWY_DYNAMIC_DISPATCH(AffineGelu);
  ParallelFor(0, p.coarse_count, 64, [&](int64_t first, int64_t last) {
    for (int64_t c = first; c < last; ++c) {
      float* out = p.out + c * p.channels;
      const auto at = static_cast<size_t>(c);
      for (int32_t m = begin[at]; m < begin[at + 1]; ++m) {
        const float* x = p.input + members[static_cast<size_t>(m)] * p.channels;
        if (m == begin[at]) {
          std::copy(x, x + p.channels, out);
          continue;
        }
        // NaN wins, as in PyTorch: it must not be hidden by a neighbour.
        for (int64_t k = 0; k < p.channels; ++k) out[k] = x[k] > out[k] || x[k] != x[k] ? x[k] : out[k];
      }
      affine_gelu(p.channels, p.scale, p.shift, out);
    }
  });
}

void ClusterAddCpu(const ClusterAddParams& p) {
  ParallelFor(0, p.fine_count, 256, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const float* skip = p.skip + i * p.channels;
      const float* coarse = p.coarse + p.cluster[i] * p.channels;
      float* out = p.out + i * p.channels;
      for (int64_t k = 0; k < p.channels; ++k) out[k] = skip[k] + coarse[k];
    }
  });
}

}  // namespace anchorsplat
#endif
