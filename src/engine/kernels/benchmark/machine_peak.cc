#include "kernels/benchmark/machine_peak.h"

#include <atomic>
#include <chrono>
#include <cstdint>

#include "core/parallel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/benchmark/machine_peak.cc"
#include <hwy/foreach_target.h>  // compiles this file once per SIMD target
#include <hwy/highway.h>

#include "kernels/unroll.h"

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Returns the operations of `rounds` rounds. Writes the sums to `sink` so that they are not optimised away.
double MultiplyAdds(int64_t rounds, float* sink) {
  const hn::CappedTag<float, 16> d;
  constexpr int kSums = 12;  // enough to hide the latency of each
  hn::VFromD<hn::CappedTag<float, 16>> sums[kSums];
  ANCHORSPLAT_UNROLL
  for (int i = 0; i < kSums; ++i) sums[i] = hn::Set(d, sink[i]);
  const auto x = hn::Set(d, sink[kSums]);
  const auto y = hn::Set(d, sink[kSums + 1]);
  for (int64_t round = 0; round < rounds; ++round) {
    ANCHORSPLAT_UNROLL
    for (int i = 0; i < kSums; ++i) sums[i] = hn::MulAdd(sums[i], x, y);
  }
  ANCHORSPLAT_UNROLL
  for (int i = 0; i < kSums; ++i) sink[i] = hn::GetLane(hn::SumOfLanes(d, sums[i]));
  return 2.0 * static_cast<double>(rounds) * kSums * static_cast<double>(hn::Lanes(d));
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

HWY_EXPORT(MultiplyAdds);

double MeasurePeakFlops(double seconds) {
  using Clock = std::chrono::steady_clock;
  const auto multiply_adds = HWY_DYNAMIC_DISPATCH(MultiplyAdds);
  const auto start = Clock::now();
  std::atomic<int64_t> operations = 0;
  ParallelFor(0, ThreadCount(), 1, [&](int64_t, int64_t) {
    float sink[16] = {};
    sink[12] = 0.5f;
    do {
      operations += static_cast<int64_t>(multiply_adds(2000, sink));
    } while (std::chrono::duration<double>(Clock::now() - start).count() < seconds);
  });
  return static_cast<double>(operations) / std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace anchorsplat
#endif
