#include "kernels/serialization.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "core/random.h"

namespace anchorsplat {
namespace {

using testing::ElementsAre;

// Codes that the published PTv3 produces for these voxels.
const std::vector<int32_t> kVoxels = {0,   0,   0,   1,   0,   0,   0,   1,   0,   0,   0,   1,   1,
                                      2,   3,   383, 0,   0,   0,   383, 0,   0,   0,   383, 383, 383,
                                      383, 100, 200, 300, 255, 255, 255, 256, 256, 256, 384, 12,  77};

std::vector<int64_t> Codes(Curve curve, int depth, const std::vector<int32_t>& voxels = kVoxels) {
  std::vector<int64_t> codes(voxels.size() / 3);
  CurveCodes(curve, depth, voxels, codes);
  return codes;
}

TEST(Serialization, ZOrderCodes) {
  const auto expected =
      ElementsAre(0, 4, 2, 1, 29, 68307236, 34153618, 17076809, 119537663, 22710080, 16777215, 117440512, 75761345);
  EXPECT_THAT(Codes(Curve::kZ, 9), expected);
  EXPECT_THAT(Codes(Curve::kZ, 10), expected) << "z codes do not depend on the depth";
  EXPECT_THAT(Codes(Curve::kZTrans, 9), ElementsAre(0, 2, 4, 1, 43, 34153618, 68307236, 17076809, 119537663, 26839744,
                                                    16777215, 117440512, 38013761));
}

TEST(Serialization, HilbertCodes) {
  EXPECT_THAT(Codes(Curve::kHilbert, 9), ElementsAre(0, 1, 7, 3, 48, 126128713, 63214153, 18874367, 85384045, 33097122,
                                                     11983725, 83886080, 133653681));
  EXPECT_THAT(Codes(Curve::kHilbertTrans, 9), ElementsAre(0, 7, 1, 3, 38, 63214153, 126128713, 18874367, 85384045,
                                                          24135698, 11983725, 83886080, 61153315));
  EXPECT_THAT(Codes(Curve::kHilbert, 10), ElementsAre(0, 7, 3, 1, 36, 63214153, 18874367, 126128713, 85384045,
                                                      124266514, 11983725, 83886080, 62655879));
  const std::vector<int32_t> small = {0, 0, 0, 1, 2, 3, 100, 200, 30, 255, 255, 255, 255, 0, 0};
  EXPECT_THAT(Codes(Curve::kHilbert, 8, small), ElementsAre(0, 22, 7387528, 11983725, 16777215));
  EXPECT_THAT(Codes(Curve::kHilbert, 9, small), ElementsAre(0, 48, 3921198, 11983725, 7789421));
}

TEST(Serialization, DepthRules) {
  EXPECT_EQ(CurveDepth(0), 0);
  EXPECT_EQ(CurveDepth(383), 9);
  EXPECT_EQ(CurveDepth(255), 8);
  EXPECT_EQ(CurveDepth(255, DepthRule::kLargestPlusOne), 9);
  EXPECT_EQ(CurveDepth(254, DepthRule::kLargestPlusOne), 8);
}

TEST(Serialization, HilbertVisitsFaceNeighbours) {
  // The curve's definition: consecutive codes are voxels that share a face, and every voxel is visited once.
  for (const Curve curve : {Curve::kHilbert, Curve::kHilbertTrans}) {
    const int depth = 4, side = 16;
    std::vector<std::array<int, 3>> at(static_cast<size_t>(side * side * side), {-1, -1, -1});
    for (int x = 0; x < side; ++x) {
      for (int y = 0; y < side; ++y) {
        for (int z = 0; z < side; ++z) at.at(static_cast<size_t>(CurveCode(curve, depth, x, y, z))) = {x, y, z};
      }
    }
    for (size_t i = 1; i < at.size(); ++i) {
      const int steps =
          std::abs(at[i][0] - at[i - 1][0]) + std::abs(at[i][1] - at[i - 1][1]) + std::abs(at[i][2] - at[i - 1][2]);
      ASSERT_EQ(steps, 1) << "code " << i;
    }
  }
}

TEST(Serialization, HalvedVoxelsHaveShiftedCodes) {
  Random random(1);
  for (int i = 0; i < 2000; ++i) {
    const int32_t x = static_cast<int32_t>(random.Below(1 << 21)), y = static_cast<int32_t>(random.Below(1 << 21)),
                  z = static_cast<int32_t>(random.Below(1 << 21));
    for (int c = 0; c < kCurves; ++c) {
      const Curve curve = static_cast<Curve>(c);
      const int64_t code = CurveCode(curve, kMaxCurveDepth, x, y, z);
      ASSERT_GE(code, 0);
      ASSERT_EQ(CurveCode(curve, kMaxCurveDepth - 1, x >> 1, y >> 1, z >> 1), code >> 3);
    }
  }
}

TEST(Serialization, OrderIsStable) {
  Random random(2);
  for (const int64_t range : {int64_t{1}, int64_t{50}, std::numeric_limits<int64_t>::max()}) {
    std::vector<int64_t> codes(3000);
    for (auto& code : codes) code = random.Below(range);
    std::vector<int32_t> expected(codes.size());
    std::iota(expected.begin(), expected.end(), 0);
    std::stable_sort(expected.begin(), expected.end(), [&](int32_t a, int32_t b) {
      return codes[static_cast<size_t>(a)] < codes[static_cast<size_t>(b)];
    });
    EXPECT_THAT(OrderOfCodes(codes), testing::ElementsAreArray(expected)) << range;
  }
  EXPECT_TRUE(OrderOfCodes({}).empty());
}

TEST(Serialization, ShufflesAreThoseOfPyTorch) {
  EXPECT_EQ(ShufflesFromSeed(918), (Shuffles{{{1, 2, 3, 0}, {0, 3, 2, 1}, {1, 0, 2, 3}, {3, 1, 0, 2}, {0, 3, 2, 1}}}));
  EXPECT_EQ(ShufflesFromSeed(0), (Shuffles{{{0, 1, 3, 2}, {0, 2, 3, 1}, {3, 2, 0, 1}, {3, 0, 2, 1}, {0, 1, 2, 3}}}));
}

TEST(Serialization, ShufflesMustBePermutations) {
  EXPECT_TRUE(Validate(kNoShuffles).ok());
  Shuffles twice = kNoShuffles;
  twice[2] = {0, 1, 1, 3};
  ASSERT_FALSE(Validate(twice).ok());
  EXPECT_THAT(Validate(twice).error().message, testing::HasSubstr("shuffle 3 of 5"));
}

}  // namespace
}  // namespace anchorsplat
