#pragma once

#include <cmath>
#include <cstdint>

namespace anchorsplat {

// Adam (Kingma & Ba 2015, with ε as in PyTorch) at one step:
//     m ← m + (1 − β₁)(g − m),   v ← β₂ v + (1 − β₂) g²,   x ← x − rate/(1 − β₁ᵗ) · m / (√v/√(1 − β₂ᵗ) + ε).
struct AdamNumbers {
  float one_minus_beta1;         // 1 − β₁
  float beta2, one_minus_beta2;  // β₂, 1 − β₂
  float inverse_correction2;     // 1/√(1 − β₂ᵗ)
  float epsilon;
};

// `step`: t, from 1. Computed in double: at β₂ = 0.999 a float would lose three digits of 1 − βᵗ in the first steps.
inline AdamNumbers MakeAdamNumbers(double beta1, double beta2, float epsilon, int64_t step) {
  const double correction2 = 1 - std::pow(beta2, static_cast<double>(step));
  return {static_cast<float>(1 - beta1), static_cast<float>(beta2), static_cast<float>(1 - beta2),
          static_cast<float>(1 / std::sqrt(correction2)), epsilon};
}
inline float CorrectedRate(float rate, double beta1, int64_t step) {  // rate/(1 − β₁ᵗ)
  return static_cast<float>(static_cast<double>(rate) / (1 - std::pow(beta1, static_cast<double>(step))));
}

// Runs of contiguous numbers with the same periodic pattern of rates.
struct AdamRuns {
  int64_t runs;
  int64_t stride;      // between starts of runs
  int64_t count;       // numbers per run
  int64_t period;      // of `rates`; a multiple of every vector length
  const float* rates;  // [period] from CorrectedRate
  AdamNumbers numbers;
  const float* gradient;
  float* first_moment;
  float* second_moment;
  float* values;
};

inline constexpr int64_t kMaxAdamLanes = 16;
// The smallest multiple of `columns` that is also one of every vector length.
inline int64_t AdamPeriod(int64_t columns) {
  int64_t period = columns;
  while (period % kMaxAdamLanes != 0) period += columns;
  return period;
}

// An Adam step of SH coefficients, applied as their gradient is computed, which is never stored.
struct CoefficientStep {
  AdamNumbers numbers;
  int64_t columns;         // leading columns of each row to update; all that have a gradient
  float first_rate, rate;  // from CorrectedRate: of the first three columns, and of the rest
  // in and out, [N,K,3] as in the cloud
  float* first_moment;
  float* second_moment;
  float* values;  // of the rendered cloud
};

}  // namespace anchorsplat
