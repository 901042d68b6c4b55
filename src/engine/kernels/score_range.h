#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "kernels/rounding.h"

namespace anchorsplat {

enum class ScoreRange : uint8_t {
  kBounded,  // −125 … 125 after the shift
  kAny,      // at most 125 after the shift, but perhaps far below
};

// Chooses the shift subtracted from each query's scores (exponents of 2). Softmax is invariant to it; it keeps
// exponentials in range, of float or of fp16 if they are rounded to that. `bounds` holds |q||k| ≥ |q·k| for the longest
// key: if small, no shift is needed. Else the largest score of a few keys is tried, and the largest of all only if that
// is too far from the bound. `largest_scores(all)` writes each query's largest score to `shifts`, over all keys or a
// few.
template <typename LargestScores>
ScoreRange ChooseShifts(Rounding rounding, int count, const float* bounds, float* shifts,
                        LargestScores&& largest_scores) {
  const float unshifted = rounding == Rounding::kHalf ? 10.0f : 60.0f;  // 2^-10 is still a normal fp16
  const float highest = rounding == Rounding::kHalf ? 15.0f : 60.0f;    // 2^15 is below its largest
  constexpr float kLowest = 120.0f;
  const auto all_within = [&](float limit, float sign, bool magnitudes) {
    bool within = true;  // of NaN: false
    for (int i = 0; i < count; ++i) {
      const float shift = magnitudes ? std::abs(shifts[i]) : shifts[i];
      within = (bounds[i] + sign * shift <= limit) && within;
    }
    return within;
  };
  std::fill(shifts, shifts + count, 0.0f);
  if (all_within(unshifted, 0, false)) return ScoreRange::kBounded;
  largest_scores(false);
  if (!all_within(highest, -1, false)) largest_scores(true);
  return all_within(kLowest, 1, true) ? ScoreRange::kBounded : ScoreRange::kAny;
}

}  // namespace anchorsplat
