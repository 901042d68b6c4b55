#include "bench/machine_limits.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/buffer.h"
#include "core/parallel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bench/machine_limits.cc"
// foreach_target compiles this file once per instruction set, so it must come first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Makes `rounds` × twelve independent multiply-adds, more than latency × units of any processor so far. Returns their
// sum, so that nothing is optimised away, and the number of scalar multiply-adds.
void MultiplyAdd(int64_t rounds, float* sum, int64_t* made) {
  const hn::ScalableTag<float> d;
  const auto m = hn::Set(d, 0.999f), a = hn::Set(d, 0.001f);
  auto x0 = m, x1 = a, x2 = m, x3 = a, x4 = m, x5 = a, x6 = m, x7 = a, x8 = m, x9 = a, x10 = m, x11 = a;
  for (int64_t r = 0; r < rounds; ++r) {
    x0 = hn::MulAdd(x0, m, a), x1 = hn::MulAdd(x1, m, a), x2 = hn::MulAdd(x2, m, a), x3 = hn::MulAdd(x3, m, a);
    x4 = hn::MulAdd(x4, m, a), x5 = hn::MulAdd(x5, m, a), x6 = hn::MulAdd(x6, m, a), x7 = hn::MulAdd(x7, m, a);
    x8 = hn::MulAdd(x8, m, a), x9 = hn::MulAdd(x9, m, a), x10 = hn::MulAdd(x10, m, a), x11 = hn::MulAdd(x11, m, a);
  }
  const auto s0 = hn::Add(hn::Add(x0, x1), hn::Add(x2, x3));
  const auto s1 = hn::Add(hn::Add(x4, x5), hn::Add(x6, x7));
  const auto s2 = hn::Add(hn::Add(x8, x9), hn::Add(x10, x11));
  *sum = hn::GetLane(hn::Add(s0, hn::Add(s1, s2)));
  *made = rounds * 12 * static_cast<int64_t>(hn::Lanes(d));
}

// Sum of [first, last), of a multiple of 64 floats.
float Read(const float* HWY_RESTRICT first, const float* last) {
  const hn::CappedTag<float, 16> d;
  const size_t lanes = hn::Lanes(d);
  auto s0 = hn::Zero(d), s1 = s0, s2 = s0, s3 = s0;
  for (; first != last; first += 4 * lanes) {
    s0 = hn::Add(s0, hn::Load(d, first));
    s1 = hn::Add(s1, hn::Load(d, first + lanes));
    s2 = hn::Add(s2, hn::Load(d, first + 2 * lanes));
    s3 = hn::Add(s3, hn::Load(d, first + 3 * lanes));
  }
  return hn::GetLane(hn::Add(hn::Add(s0, s1), hn::Add(s2, s3)));
}

const char* InstructionSet() { return hwy::TargetName(HWY_TARGET); }

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

HWY_EXPORT(MultiplyAdd);
HWY_EXPORT(Read);
HWY_EXPORT(InstructionSet);

namespace {

// The shortest of several tries, because disturbances only lengthen it.
template <typename Work>
double BestSeconds(int tries, Work&& work) {
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i < tries; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return best;
}

}  // namespace

MachineLimits MeasureMachineLimits() {
  MachineLimits limits;
  limits.threads = ThreadCount();
  limits.instruction_set = HWY_DYNAMIC_DISPATCH(InstructionSet)();

  constexpr int64_t kRounds = 1'000'000;
  const size_t tasks = static_cast<size_t>(limits.threads) * 4;
  std::vector<float> sums(tasks);
  std::vector<int64_t> made(tasks);
  double seconds = BestSeconds(5, [&] {
    ParallelFor(0, static_cast<int64_t>(tasks), 1, [&](int64_t task, int64_t) {
      const size_t t = static_cast<size_t>(task);
      HWY_DYNAMIC_DISPATCH(MultiplyAdd)(kRounds, &sums[t], &made[t]);
    });
  });
  for (const int64_t m : made) limits.fma_per_second += static_cast<double>(m) / seconds;

  constexpr int64_t kFloats = int64_t{64} << 20;  // 256 MiB, larger than any cache
  constexpr int64_t kPiece = int64_t{1} << 16;
  Buffer<float> memory(static_cast<size_t>(kFloats));
  std::vector<float> totals(static_cast<size_t>(kFloats / kPiece));
  ParallelFor(0, kFloats, kPiece, [&](int64_t first, int64_t last) {
    std::fill(&memory[static_cast<size_t>(first)], memory.data() + last, 1.0f);
  });
  seconds = BestSeconds(5, [&] {
    ParallelFor(0, kFloats, kPiece, [&](int64_t first, int64_t last) {
      totals[static_cast<size_t>(first / kPiece)] =
          HWY_DYNAMIC_DISPATCH(Read)(memory.data() + first, memory.data() + last);
    });
  });
  limits.bytes_per_second = static_cast<double>(kFloats) * sizeof(float) / seconds;
  return limits;
}

}  // namespace anchorsplat
#endif
