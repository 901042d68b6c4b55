#include "fit/adam.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/parallel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fit/adam.cc"
// foreach_target compiles this file once per instruction set, so it must come first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

// What both the dispatcher and the targets see, once.
#ifndef ANCHORSPLAT_FIT_ADAM_ONCE
#define ANCHORSPLAT_FIT_ADAM_ONCE
namespace anchorsplat {

// Runs of numbers that lie one after the other, each with the same rates, in a pattern that repeats.
struct AdamRuns {
  int64_t runs;
  int64_t stride;      // from one run to the next
  int64_t count;       // numbers in each
  int64_t period;      // of `rates`, a multiple of every vector length
  const float* rates;  // [period] rate/(1 − β₁ᵗ)
  float take1;         // 1 − β₁
  float keep2, take2;  // β₂, 1 − β₂
  float inverse_root;  // 1/√(1 − β₂ᵗ)
  float epsilon;
  const float* gradient;
  float* first_moment;
  float* second_moment;
  float* values;
};

}  // namespace anchorsplat
#endif

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
// Numbers [i, …) of a run, as many whole registers as there are before `count`. Returns where it stopped. A number's
// result does not depend on the register's length.
template <class D>
HWY_INLINE int64_t UpdateSpan(D d, const AdamRuns& runs, int64_t offset, int64_t i, int64_t& phase) {
  const auto lanes = static_cast<int64_t>(hn::Lanes(d));
  const auto take1 = hn::Set(d, runs.take1), keep2 = hn::Set(d, runs.keep2), take2 = hn::Set(d, runs.take2),
             inverse_root = hn::Set(d, runs.inverse_root), epsilon = hn::Set(d, runs.epsilon);
  const float* gradient = runs.gradient + offset;
  float* first_moment = runs.first_moment + offset;
  float* second_moment = runs.second_moment + offset;
  float* values = runs.values + offset;
  for (; i + lanes <= runs.count; i += lanes) {
    const auto g = hn::LoadU(d, gradient + i);
    auto m = hn::LoadU(d, first_moment + i), v = hn::LoadU(d, second_moment + i), x = hn::LoadU(d, values + i);
    m = hn::MulAdd(take1, hn::Sub(g, m), m);
    v = hn::MulAdd(hn::Mul(take2, g), g, hn::Mul(keep2, v));
    const auto denominator = hn::MulAdd(hn::Sqrt(v), inverse_root, epsilon);
    x = hn::NegMulAdd(hn::LoadU(d, runs.rates + phase), hn::Div(m, denominator), x);
    hn::StoreU(m, d, first_moment + i);
    hn::StoreU(v, d, second_moment + i);
    hn::StoreU(x, d, values + i);
    phase += lanes;
    if (phase == runs.period) phase = 0;
  }
  return i;
}

void UpdateRuns(const AdamRuns& runs) {
  for (int64_t run = 0; run < runs.runs; ++run) {
    const int64_t offset = run * runs.stride;
    int64_t phase = 0;
    int64_t i = UpdateSpan(hn::CappedTag<float, 16>(), runs, offset, 0, phase);
    // Parts of rows are short (3, 12 or 27 numbers): what is left goes by shorter registers.
    i = UpdateSpan(hn::CappedTag<float, 4>(), runs, offset, i, phase);
    UpdateSpan(hn::CappedTag<float, 1>(), runs, offset, i, phase);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

namespace {
HWY_EXPORT(UpdateRuns);

constexpr int64_t kMostLanes = 16;
constexpr int64_t kChunkNumbers = 1 << 15;  // per task: half a megabyte of the four arrays, some 10 µs

// The smallest multiple of `columns` that is one of kMostLanes too.
int64_t PatternPeriod(int64_t columns) {
  int64_t period = columns;
  while (period % kMostLanes != 0) period += columns;
  return period;
}
}  // namespace

void AdamStep(const AdamParams& p) {
  if (p.rows <= 0 || p.columns <= 0) return;
  // 1 − βᵗ in double: at β₂ = 0.999 a float would lose three digits of it in the first steps.
  const double correction1 = 1 - std::pow(p.beta1, static_cast<double>(p.step));
  const double correction2 = 1 - std::pow(p.beta2, static_cast<double>(p.step));
  const auto corrected = [&](float rate) { return static_cast<float>(static_cast<double>(rate) / correction1); };

  // Whole rows are one run with a repeating pattern of rates; parts of rows are a run each.
  const bool whole = p.columns == p.stride;
  const int64_t period = PatternPeriod(p.columns);
  std::vector<float> rates(static_cast<size_t>(period));
  for (int64_t k = 0; k < period; ++k) {
    rates[static_cast<size_t>(k)] = corrected(k % p.columns < p.first_columns ? p.first_rate : p.rate);
  }
  const int64_t rows_per_chunk = std::max<int64_t>(1, kChunkNumbers / p.columns);
  ParallelFor(0, p.rows, rows_per_chunk, [&](int64_t begin, int64_t end) {
    AdamRuns runs;
    runs.runs = whole ? 1 : end - begin;
    runs.stride = p.stride;
    runs.count = whole ? (end - begin) * p.stride : p.columns;
    runs.period = period;
    runs.rates = rates.data();
    runs.take1 = static_cast<float>(1 - p.beta1);
    runs.keep2 = static_cast<float>(p.beta2), runs.take2 = static_cast<float>(1 - p.beta2);
    runs.inverse_root = static_cast<float>(1 / std::sqrt(correction2));
    runs.epsilon = p.epsilon;
    runs.gradient = p.gradient + begin * p.stride;
    runs.first_moment = p.first_moment + begin * p.stride;
    runs.second_moment = p.second_moment + begin * p.stride;
    runs.values = p.values + begin * p.stride;
    HWY_DYNAMIC_DISPATCH(UpdateRuns)(runs);
  });
}

}  // namespace anchorsplat
#endif  // HWY_ONCE
