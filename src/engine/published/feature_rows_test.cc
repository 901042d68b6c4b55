#include "published/feature_rows.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

namespace anchorsplat {
namespace {

GaussianCloud OneGaussian(int degree) {
  GaussianCloud cloud;
  cloud.Resize(1, degree);
  for (int i = 0; i < 3; ++i) cloud.means[static_cast<size_t>(i)] = 0.1f * static_cast<float>(i);
  for (int i = 0; i < 3; ++i) cloud.log_scales[static_cast<size_t>(i)] = static_cast<float>(-i);
  for (int i = 0; i < 4; ++i) cloud.quats[static_cast<size_t>(i)] = static_cast<float>(10 + i);
  cloud.opacity_logits[0] = 7;
  // value 100·coefficient + rgb
  for (size_t i = 0; i < cloud.sh.size(); ++i) cloud.sh[i] = static_cast<float>(100 * (i / 3) + i % 3);
  return cloud;
}

TEST(FeatureRows, ColumnsAreTheNetworks) {
  const std::vector<int64_t> rows = {0};
  Normalisation n;
  n.scale = 2;
  n.shift = {0.5f, 0.25f, 0};
  const Buffer<float> f = FeatureRows(OneGaussian(3), rows, n, ShPadding::kZeros);
  ASSERT_EQ(f.size(), 59u);
  EXPECT_EQ(f[1], 0.1f * 2 + 0.25f);
  EXPECT_EQ(f[4], -1 + std::log(2.0f));
  EXPECT_EQ(f[6], 7);
  EXPECT_EQ(f[10], 13);
  EXPECT_EQ(f[13], 2) << "dc, blue";
  EXPECT_EQ(f[14], 100) << "first coefficient, red";
  EXPECT_EQ(f[15], 101) << "first coefficient, green";
  EXPECT_EQ(f[58], 1502);
  // Degree 3 has nothing to pad.
  EXPECT_EQ(f, FeatureRows(OneGaussian(3), rows, n, ShPadding::kScrambled));
}

TEST(FeatureRows, LowerDegreesArePaddedOrScrambled) {
  const std::vector<int64_t> rows = {0};
  const Buffer<float> padded = FeatureRows(OneGaussian(1), rows, {}, ShPadding::kZeros);
  EXPECT_EQ(padded[14 + 3], 200);
  EXPECT_EQ(padded[14 + 4], 201);
  EXPECT_EQ(padded[14 + 9], 0);
  // The file lists r1 r2 r3 g1 g2 g3 b1 b2 b3; read as 15 of red, it is red's coefficients 0 to 8.
  const Buffer<float> scrambled = FeatureRows(OneGaussian(1), rows, {}, ShPadding::kScrambled);
  const float expected[] = {100, 200, 300, 101, 201, 301, 102, 202, 302, 0};
  for (size_t c = 0; c < 10; ++c) {
    EXPECT_EQ(scrambled[14 + 3 * c], expected[c]) << c;
    EXPECT_EQ(scrambled[15 + 3 * c], 0) << c;
  }
  // Degree 2: 24 values, 15 to red and 9 to green.
  const Buffer<float> second = FeatureRows(OneGaussian(2), rows, {}, ShPadding::kScrambled);
  EXPECT_EQ(second[14 + 3 * 14], 701) << "value 14 of the list: coefficient 7 of green";
  EXPECT_EQ(second[15], 801) << "value 15: coefficient 8 of green";
  const Buffer<float> none = FeatureRows(OneGaussian(0), rows, {}, ShPadding::kScrambled);
  EXPECT_EQ(std::accumulate(none.begin() + 14, none.end(), 0.0f), 0);
}

}  // namespace
}  // namespace anchorsplat
