#include "fit/adam.h"

#include <algorithm>
#include <vector>

#include "core/parallel.h"
#include "render/adam_runs.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fit/adam.cc"
// foreach_target compiles this file once per instruction set, so it must come first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include "render/adam-inl.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {
namespace {

void UpdateRuns(const AdamRuns& runs) { UpdateAll(runs); }

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

namespace {
HWY_EXPORT(UpdateRuns);

constexpr int64_t kChunkNumbers = 1 << 15;  // per task: half a megabyte in four arrays, some 10 µs
}  // namespace

void AdamStep(const AdamParams& p) {
  if (p.rows <= 0 || p.columns <= 0) return;
  // Whole rows form one run with a repeating pattern of rates; partial rows are one run each.
  const bool whole = p.columns == p.stride;
  const int64_t period = AdamPeriod(p.columns);
  std::vector<float> rates(static_cast<size_t>(period));
  const float first_rate = CorrectedRate(p.first_rate, p.beta1, p.step), rate = CorrectedRate(p.rate, p.beta1, p.step);
  for (int64_t k = 0; k < period; ++k) {
    rates[static_cast<size_t>(k)] = k % p.columns < p.first_columns ? first_rate : rate;
  }
  const int64_t rows_per_chunk = std::max<int64_t>(1, kChunkNumbers / p.columns);
  ParallelFor(0, p.rows, rows_per_chunk, [&](int64_t begin, int64_t end) {
    AdamRuns runs;
    runs.runs = whole ? 1 : end - begin;
    runs.stride = p.stride;
    runs.count = whole ? (end - begin) * p.stride : p.columns;
    runs.period = period;
    runs.rates = rates.data();
    runs.numbers = MakeAdamNumbers(p.beta1, p.beta2, p.epsilon, p.step);
    runs.gradient = p.gradient + begin * p.stride;
    runs.first_moment = p.first_moment + begin * p.stride;
    runs.second_moment = p.second_moment + begin * p.stride;
    runs.values = p.values + begin * p.stride;
    HWY_DYNAMIC_DISPATCH(UpdateRuns)(runs);
  });
}

}  // namespace anchorsplat
#endif  // HWY_ONCE
