#include "formats/ply/color_range.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace anchorsplat {
namespace {

TEST(ColorRange, TellsBytesFromUnits) {
  const auto of = [](const std::vector<float>& colors) { return FullIntensityOf(colors); };
  EXPECT_EQ(of({}), 1);
  EXPECT_EQ(of({0, 0, 0}), 1);
  EXPECT_EQ(of({0, 1, 1, 0}), 1);
  EXPECT_EQ(of({0.2f, 0.7f, 1.3f, -0.1f, NAN, INFINITY}), 1) << "some are brighter than white";
  EXPECT_EQ(of({12.5f, 200, 31, 255}), 255);
  EXPECT_EQ(of({0, 1, 2, 3, 1, 1, 1}), 255) << "whole numbers, of a dark picture";
  EXPECT_EQ(of({0.5f, 2.5f, 3.25f}), 255) << "most are beyond 1";
  EXPECT_EQ(of({0.5f, 30000, 65535}), 65535);
  std::vector<float> one_stray(1000, 0.5f);
  one_stray[7] = 1e6f;
  EXPECT_EQ(of(one_stray), 1);
}

}  // namespace
}  // namespace anchorsplat
