#pragma once

#include <cmath>
#include <cstdint>

namespace anchorsplat {

// Adam (Kingma & Ba 2015, with PyTorch's place for ε) at one step:
//     m ← m + (1 − β₁)(g − m),   v ← β₂ v + (1 − β₂) g²,   x ← x − rate/(1 − β₁ᵗ) · m / (√v/√(1 − β₂ᵗ) + ε).
struct AdamNumbers {
  float take1;         // 1 − β₁
  float keep2, take2;  // β₂, 1 − β₂
  float inverse_root;  // 1/√(1 − β₂ᵗ)
  float epsilon;
};

// `step` is t, 1 for the first one. In double: at β₂ = 0.999 a float would lose three digits of 1 − βᵗ at the start.
inline AdamNumbers MakeAdamNumbers(double beta1, double beta2, float epsilon, int64_t step) {
  const double correction2 = 1 - std::pow(beta2, static_cast<double>(step));
  return {static_cast<float>(1 - beta1), static_cast<float>(beta2), static_cast<float>(1 - beta2),
          static_cast<float>(1 / std::sqrt(correction2)), epsilon};
}
inline float CorrectedRate(float rate, double beta1, int64_t step) {  // rate/(1 − β₁ᵗ)
  return static_cast<float>(static_cast<double>(rate) / (1 - std::pow(beta1, static_cast<double>(step))));
}

// Runs of numbers that lie one after the other, each with the same rates, in a pattern that repeats.
struct AdamRuns {
  int64_t runs;
  int64_t stride;      // from one run to the next
  int64_t count;       // numbers in each
  int64_t period;      // of `rates`, a multiple of every vector length
  const float* rates;  // [period] corrected
  AdamNumbers numbers;
  const float* gradient;
  float* first_moment;
  float* second_moment;
  float* values;
};

inline constexpr int64_t kAdamLanesAtMost = 16;
// The smallest multiple of `columns` that is one of every vector length too.
inline int64_t AdamPeriod(int64_t columns) {
  int64_t period = columns;
  while (period % kAdamLanesAtMost != 0) period += columns;
  return period;
}

// A step of the coefficients of spherical harmonics, made while their gradient is at hand and never written down.
struct CoefficientStep {
  AdamNumbers numbers;
  int64_t columns;         // of each row that are updated, the first ones; all that have a gradient
  float first_rate, rate;  // corrected: of the first three columns, and of the others
  // in and out, [N,K,3] as the cloud's
  float* first_moment;
  float* second_moment;
  float* values;  // those of the cloud whose picture it was
};

}  // namespace anchorsplat
