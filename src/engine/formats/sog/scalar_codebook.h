#pragma once

#include <array>
#include <cstdint>

namespace anchorsplat {

// 256 values that stand for all of an array, with the least sum of squared distances.
struct ScalarCodebook {
  std::array<float, 256> values{};  // ascending; unused ones repeat the last

  uint8_t IndexOf(float value) const;  // of the nearest; NaN: 0
};

// Optimal for the histogram of 8,192 bins over the finite values (bins count with their own mean, so the loss against
// the optimum of the values themselves is below a bin's variance). One-dimensional k-means has an exact solution: the
// best split of the first m bins into j clusters follows from those into j − 1, and as the last cluster's begin moves
// monotonically with m, divide and conquer finds a layer in M log M (Grønlund et al. 2017, "Fast Exact k-Means in 1D").
// Values farther than 64 standard deviations from the mean count as that far. `values` has `rows` rows of `width`
// values that begin `stride` floats apart.
ScalarCodebook BuildScalarCodebook(const float* values, int64_t rows, int64_t width, int64_t stride);

}  // namespace anchorsplat
