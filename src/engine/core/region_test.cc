#include "core/region.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace anchorsplat {
namespace {

std::optional<Region> Of(const std::vector<double>& numbers) { return RegionOf(numbers); }

TEST(Region, BoxesByAnyTwoCorners) {
  const auto box = Of({1, -2, 3, -1, 2, 0});
  ASSERT_TRUE(box);
  EXPECT_EQ(box->low, (std::array<double, 3>{-1, -2, 0}));
  EXPECT_EQ(box->high, (std::array<double, 3>{1, 2, 3}));
  EXPECT_FALSE(box->radius);
  const float border[] = {1, 2, 3}, outside[] = {1.001f, 0, 1}, nan[] = {NAN, 0, 1};
  EXPECT_TRUE(box->Contains(border));
  EXPECT_FALSE(box->Contains(outside));
  EXPECT_FALSE(box->Contains(nan));
  EXPECT_TRUE(Of({1, 1, 1, 1, 1, 1}));  // a point
}

TEST(Region, SpheresByCentreAndRadius) {
  const auto sphere = Of({1, 0, 0, 2});
  ASSERT_TRUE(sphere);
  EXPECT_EQ(sphere->radius, 2);
  const float border[] = {3, 0, 0}, outside[] = {-1, 1, 0}, nan[] = {1, NAN, 0};
  EXPECT_TRUE(sphere->Contains(border));
  EXPECT_FALSE(sphere->Contains(outside));
  EXPECT_FALSE(sphere->Contains(nan));
}

TEST(Region, WhatIsNone) {
  const double inf = std::numeric_limits<double>::infinity();
  for (const std::vector<double>& numbers : std::vector<std::vector<double>>{{},
                                                                             {1, 2, 3},
                                                                             {1, 2, 3, 4, 5},
                                                                             {1, 2, 3, 4, 5, 6, 7},
                                                                             {0, 0, 0, 0},
                                                                             {0, 0, 0, -1},
                                                                             {0, 0, 0, NAN},
                                                                             {inf, 0, 0, 1},
                                                                             {0, 0, 0, 1, 1, inf},
                                                                             {NAN, 0, 0, 1, 1, 1}}) {
    EXPECT_FALSE(Of(numbers)) << numbers.size();
  }
}

}  // namespace
}  // namespace anchorsplat
