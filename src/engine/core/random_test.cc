#include "core/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace anchorsplat {
namespace {

// xoshiro256** with a state from splitmix64(42), computed apart from this code.
TEST(Random, IsTheNamedGenerator) {
  Random random(42);
  EXPECT_EQ(random.Next(), 0x15780b2e0c2ec716u);
  EXPECT_EQ(random.Next(), 0x6104d9866d113a7eu);
  EXPECT_EQ(random.Next(), 0xae17533239e499a1u);
}

TEST(Random, SeedsDiffer) { EXPECT_NE(Random(0).Next(), Random(1).Next()); }

TEST(Random, UniformFillsItsInterval) {
  Random random(1);
  double sum = 0, low = 10, high = -10;
  constexpr int kCount = 100'000;
  for (int i = 0; i < kCount; ++i) {
    const double x = random.Uniform(-2, 4);
    ASSERT_GE(x, -2);
    ASSERT_LT(x, 4);
    sum += x;
    low = std::min(low, x);
    high = std::max(high, x);
  }
  EXPECT_NEAR(sum / kCount, 1, 0.03);
  EXPECT_LT(low, -1.99);
  EXPECT_GT(high, 3.99);
}

TEST(Random, NormalHasItsMoments) {
  Random random(2);
  double m1 = 0, m2 = 0, m4 = 0;
  constexpr int kCount = 200'000;
  for (int i = 0; i < kCount; ++i) {
    const double x = random.Normal();
    ASSERT_TRUE(std::isfinite(x));
    m1 += x / kCount;
    m2 += x * x / kCount;
    m4 += x * x * x * x / kCount;
  }
  EXPECT_NEAR(m1, 0, 0.01);
  EXPECT_NEAR(m2, 1, 0.02);
  EXPECT_NEAR(m4, 3, 0.15);
}

TEST(Random, BelowIsEven) {
  Random random(3);
  std::array<int, 7> counts{};
  for (int i = 0; i < 70'000; ++i) ++counts[static_cast<size_t>(random.Below(7))];
  for (const int n : counts) EXPECT_NEAR(n, 10'000, 500);
  EXPECT_EQ(random.Below(1), 0);
  for (int i = 0; i < 100; ++i) ASSERT_GE(random.Below(INT64_MAX), 0);
}

}  // namespace
}  // namespace anchorsplat
