#pragma once

#include <cstdint>

namespace anchorsplat {

// One Adam step (Kingma & Ba 2015, with ε placed as in PyTorch) on rows of numbers:
//     m ← m + (1 − β₁)(g − m),   v ← β₂ v + (1 − β₂) g²,   x ← x − rate/(1 − β₁ᵗ) · m / (√v/√(1 − β₂ᵗ) + ε).
// May update only the first columns of each row, and the very first at a rate of their own: SH of all degrees share a
// row, where the DC learns twenty times faster and degrees not in use yet stay.
struct AdamParams {
  int64_t rows;           // N
  int64_t stride;         // numbers per row
  int64_t columns;        // updated columns per row, the first ones; ≤ stride
  int64_t first_columns;  // of these, columns at `first_rate`; the others at `rate`
  float first_rate;       // ≥ 0
  float rate;             // ≥ 0
  double beta1, beta2;    // in [0, 1)
  float epsilon;          // > 0
  int64_t step;           // t, 1 for the first step
  const float* gradient;  // [N,stride]
  // in and out
  float* first_moment;   // [N,stride] m
  float* second_moment;  // [N,stride] v
  float* values;         // [N,stride] x
};

// Updates each number independently: the same bits for any number of threads.
void AdamStep(const AdamParams& p);

}  // namespace anchorsplat
