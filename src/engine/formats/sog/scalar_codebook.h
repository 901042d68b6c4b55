#pragma once

#include <array>
#include <cstdint>

namespace anchorsplat {

// 256 values that represent an array with the least sum of squared distances.
struct ScalarCodebook {
  std::array<float, 256> values{};  // ascending; unused ones repeat the last

  uint8_t IndexOf(float value) const;  // index of the nearest; NaN: 0
};

// Builds the optimal codebook for a histogram of 8,192 bins over the finite values. Bins count with their own mean, so
// the loss against the true optimum is below a bin's variance. One-dimensional k-means has an exact solution: the best
// split of the first m bins into j clusters follows from those into j − 1, and as the start of the last cluster is
// monotonic in m, divide and conquer computes a layer in M log M (Grønlund et al. 2017, "Fast Exact k-Means in 1D").
// Values are clamped to 64 standard deviations from the mean. `values`: `rows` rows of `width` values, `stride` floats
// apart.
ScalarCodebook BuildScalarCodebook(const float* values, int64_t rows, int64_t width, int64_t stride);

}  // namespace anchorsplat
