// Adam updates over runs of numbers. Compiled once per instruction set, as <hwy/highway.h>.

#if defined(ANCHORSPLAT_RENDER_ADAM_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef ANCHORSPLAT_RENDER_ADAM_INL_H_
#undef ANCHORSPLAT_RENDER_ADAM_INL_H_
#else
#define ANCHORSPLAT_RENDER_ADAM_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "render/adam_runs.h"

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {
namespace {

// Updates numbers [i, …) of a run in whole registers, and returns where it stopped. Results do not depend on the
// register length.
template <class D>
HWY_INLINE int64_t UpdateSpan(D d, const AdamRuns& runs, int64_t offset, int64_t i, int64_t& phase) {
  namespace hn = hwy::HWY_NAMESPACE;
  const auto lanes = static_cast<int64_t>(hn::Lanes(d));
  const AdamNumbers& n = runs.numbers;
  const auto one_minus_beta1 = hn::Set(d, n.one_minus_beta1), beta2 = hn::Set(d, n.beta2),
             one_minus_beta2 = hn::Set(d, n.one_minus_beta2), inverse_correction2 = hn::Set(d, n.inverse_correction2),
             epsilon = hn::Set(d, n.epsilon);
  const float* gradient = runs.gradient + offset;
  float* first_moment = runs.first_moment + offset;
  float* second_moment = runs.second_moment + offset;
  float* values = runs.values + offset;
  for (; i + lanes <= runs.count; i += lanes) {
    const auto g = hn::LoadU(d, gradient + i);
    auto m = hn::LoadU(d, first_moment + i), v = hn::LoadU(d, second_moment + i), x = hn::LoadU(d, values + i);
    m = hn::MulAdd(one_minus_beta1, hn::Sub(g, m), m);
    v = hn::MulAdd(hn::Mul(one_minus_beta2, g), g, hn::Mul(beta2, v));
    const auto denominator = hn::MulAdd(hn::Sqrt(v), inverse_correction2, epsilon);
    x = hn::NegMulAdd(hn::LoadU(d, runs.rates + phase), hn::Div(m, denominator), x);
    hn::StoreU(m, d, first_moment + i);
    hn::StoreU(v, d, second_moment + i);
    hn::StoreU(x, d, values + i);
    phase += lanes;
    if (phase == runs.period) phase = 0;
  }
  return i;
}

HWY_INLINE void UpdateAll(const AdamRuns& runs) {
  namespace hn = hwy::HWY_NAMESPACE;
  for (int64_t run = 0; run < runs.runs; ++run) {
    const int64_t offset = run * runs.stride;
    int64_t phase = 0;
    int64_t i = UpdateSpan(hn::CappedTag<float, 16>(), runs, offset, 0, phase);
    // Parts of rows are short (3, 12 or 27 numbers): shorter registers do the rest.
    i = UpdateSpan(hn::CappedTag<float, 4>(), runs, offset, i, phase);
    UpdateSpan(hn::CappedTag<float, 1>(), runs, offset, i, phase);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#endif  // per target
