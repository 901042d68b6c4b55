#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "model/kernels/rounding.h"

namespace anchorsplat {

enum class ScoreRange : uint8_t {
  kBounded,  // −125 … 125 after the shift
  kAny,      // at most 125 after the shift, but perhaps far below
};

// What is subtracted from the scores of each of `count` queries, which are exponents of 2. Softmax does not change with
// it, so it only has to keep the exponentials in range: of floats, and of fp16 where they are rounded to that. `bounds`
// hold |q||k| ≥ |q·k| for the longest key; often that is small and nothing needs to be subtracted, or the largest score
// of a few keys is close enough to the bound to serve for all. Only the rest pays for finding the largest score of all
// keys. `largest_scores(all)` writes to `shifts` the largest score of each query, of a few keys or of all.
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
