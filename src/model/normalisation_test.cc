#include "model/normalisation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "core/random.h"

namespace anchorsplat {
namespace {

using testing::HasSubstr;

TEST(Normalisation, AutoLooksWhereTheBoxIs) {
  const std::vector<float> centred = {-1, -0.9f, -1, 1, 1, 0.95f}, aside = {0, 0, 0, 1, 4, 2};
  const auto a = FitNormalisation(centred, NormalisationMode::kAuto);
  ASSERT_TRUE(a.ok());
  EXPECT_EQ(a->mode, NormalisationMode::kCentered);
  EXPECT_EQ(a->scale, 0.5f);
  EXPECT_EQ(a->Apply(-1, 0), 0.0f);
  EXPECT_EQ(a->Apply(1, 1), 1.0f);

  const auto b = FitNormalisation(aside, NormalisationMode::kAuto);
  ASSERT_TRUE(b.ok());
  EXPECT_EQ(b->mode, NormalisationMode::kBbox);
  EXPECT_EQ(b->scale, 0.25f);
  EXPECT_EQ(b->Apply(4, 1), 1.0f);
  EXPECT_EQ(b->Apply(0.5f, 0), 0.5f) << "short axes are centred";
  EXPECT_EQ(b->Undo(b->Apply(0.75f, 2), 2), 0.75f);
}

TEST(Normalisation, UnitNeedsNoExtent) {
  const std::vector<float> point = {0.5f, 0.25f, -0.5f};
  EXPECT_EQ(FitNormalisation(point, NormalisationMode::kUnit)->Apply(0.5f, 0), 0.75f);
  EXPECT_THAT(FitNormalisation(point, NormalisationMode::kAuto).error().message, HasSubstr("at one place"));
  EXPECT_TRUE(FitNormalisation(point, NormalisationMode::kCentered).ok());
  const std::vector<float> origin = {0, 0, 0};
  EXPECT_THAT(FitNormalisation(origin, NormalisationMode::kCentered).error().message, HasSubstr("at the origin"));
  EXPECT_FALSE(FitNormalisation({}, NormalisationMode::kAuto).ok());
  const std::vector<float> huge = {-3e38f, 0, 0, 3e38f, 0, 0};
  EXPECT_FALSE(FitNormalisation(huge, NormalisationMode::kBbox).ok()) << "the range overflows";
}

TEST(Normalisation, RoundsTwiceAndLosesExtremesAsOftenAsTheRelease) {
  // In bbox mode about a quarter of all clouds have a point that lands just outside. With a fused multiply-add it would
  // be other points.
  Random random(21);
  int lost = 0;
  const int clouds = 400;
  for (int c = 0; c < clouds; ++c) {
    std::vector<float> means(3 * 200);
    for (size_t i = 0; i < means.size(); ++i)
      means[i] = static_cast<float>(random.Uniform(3, 4 + static_cast<double>(i % 3)));
    const auto n = FitNormalisation(means, NormalisationMode::kBbox);
    ASSERT_TRUE(n.ok());
    bool outside = false;
    for (size_t i = 0; i < means.size(); ++i) {
      const float x = n->Apply(means[i], i % 3);
      volatile float product = means[i] * n->scale;  // a rounding of its own
      ASSERT_EQ(x, product + n->shift[i % 3]);
      EXPECT_GT(x, -1e-5f);
      EXPECT_LT(x, 1 + 1e-5f);
      outside = outside || x < 0 || x > 1;
    }
    lost += outside;
  }
  EXPECT_GT(lost, clouds / 10);
  EXPECT_LT(lost, clouds / 2);
}

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
