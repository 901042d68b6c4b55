#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "core/gaussian_cloud.h"
#include "core/random.h"

namespace anchorsplat {

// For tests: a cloud with normally distributed values.
inline GaussianCloud RandomCloud(int64_t n, int degree, uint64_t seed) {
  GaussianCloud cloud;
  cloud.Resize(n, degree);
  Random random(seed);
  for (Buffer<float>* array : {&cloud.means, &cloud.log_scales, &cloud.quats, &cloud.opacity_logits, &cloud.sh}) {
    for (float& x : *array) x = static_cast<float>(random.Normal());
  }
  return cloud;
}

// The same with some non-finite values in every array.
inline GaussianCloud CloudWithNonFinite(int64_t n, int degree) {
  GaussianCloud cloud = RandomCloud(n, degree, static_cast<uint64_t>(degree + 1));
  const float bad[] = {std::nanf(""), std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
  for (int64_t i = 0; i < n; i += 7) {
    const auto k = static_cast<size_t>(i);
    Buffer<float>* const arrays[] = {&cloud.means, &cloud.log_scales, &cloud.quats, &cloud.opacity_logits, &cloud.sh};
    Buffer<float>& array = *arrays[k % 5];
    const size_t width = array.size() / static_cast<size_t>(n);
    array[k * width + (k / 5) % width] = bad[k % 3];
  }
  // The largest finite number is not one of them.
  cloud.sh[0] = std::numeric_limits<float>::max();
  cloud.sh[1] = std::numeric_limits<float>::denorm_min();
  return cloud;
}

inline bool SameBits(const Buffer<float>& a, const Buffer<float>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0);
}

// Compares all stored values bitwise, and the metadata.
inline void ExpectSameCloud(const GaussianCloud& a, const GaussianCloud& b) {
  EXPECT_EQ(a.sh_degree, b.sh_degree);
  EXPECT_TRUE(SameBits(a.means, b.means));
  EXPECT_TRUE(SameBits(a.log_scales, b.log_scales));
  EXPECT_TRUE(SameBits(a.quats, b.quats));
  EXPECT_TRUE(SameBits(a.opacity_logits, b.opacity_logits));
  EXPECT_TRUE(SameBits(a.sh, b.sh));
  EXPECT_EQ(a.render_mode, b.render_mode);
  EXPECT_EQ(a.comments, b.comments);
}

}  // namespace anchorsplat
