#pragma once

#include <gtest/gtest.h>

#include <cstring>

#include "core/gaussian_cloud.h"
#include "core/random.h"

namespace anchorsplat {

// For tests: a cloud of normally distributed values.
inline GaussianCloud RandomCloud(int64_t n, int degree, uint64_t seed) {
  GaussianCloud cloud;
  cloud.Resize(n, degree);
  Random random(seed);
  for (Buffer<float>* array : {&cloud.means, &cloud.log_scales, &cloud.quats, &cloud.opacity_logits, &cloud.sh}) {
    for (float& x : *array) x = static_cast<float>(random.Normal());
  }
  return cloud;
}

inline bool SameBits(const Buffer<float>& a, const Buffer<float>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0);
}

// Every stored value, NaNs and zeros included, and the metadata.
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
