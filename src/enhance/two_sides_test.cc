#include "enhance/two_sides.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace anchorsplat {
namespace {

// Sheets of 20 × 30 balls of a hundredth, 1 apart, of opacity 0.9.
struct Sheet {
  double height = 0;
  double times = 1;  // how large
};
GaussianCloud Sheets(const std::vector<Sheet>& sheets) {
  GaussianCloud cloud;
  cloud.Resize(static_cast<int64_t>(600 * sheets.size()), 0);
  size_t i = 0;
  for (const Sheet& sheet : sheets) {
    for (int x = 0; x < 20; ++x) {
      for (int y = 0; y < 30; ++y, ++i) {
        cloud.means[3 * i] = static_cast<float>(x);
        cloud.means[3 * i + 1] = static_cast<float>(sheet.height);
        cloud.means[3 * i + 2] = static_cast<float>(y);
        for (size_t a = 0; a < 3; ++a) cloud.log_scales[3 * i + a] = static_cast<float>(std::log(0.01 * sheet.times));
        for (size_t a = 0; a < 4; ++a) cloud.quats[4 * i + a] = a == 0 ? 1 : 0;
        cloud.opacity_logits[i] = std::log(9.0f);
      }
    }
  }
  return cloud;
}

TEST(TwoSides, OneSheetIsTheSameFromEitherSide) {
  const TwoSides sides = TwoSidesOf(Sheets({{0, 1}}));
  EXPECT_NEAR(sides.shared, 1, 1e-6);
  EXPECT_NEAR(sides.coarser, 1, 1e-6);
  EXPECT_FALSE(sides.both_were_shown());
}

TEST(TwoSides, EachOfTwoHidesTheOther) {
  // 0.9 of what is seen of either side, and 0.1 × 0.9 of the other.
  const TwoSides alike = TwoSidesOf(Sheets({{0, 1}, {1, 1}}));
  EXPECT_NEAR(alike.shared, 0.1, 1e-3);
  EXPECT_NEAR(alike.coarser, 1, 1e-3);
  EXPECT_TRUE(alike.both_were_shown());
  for (const double times : {1.6, 1 / 1.6}) {
    const TwoSides coarse = TwoSidesOf(Sheets({{0, 1}, {1, times}}));
    EXPECT_NEAR(coarse.shared, 0.1, 1e-3);
    EXPECT_NEAR(coarse.coarser, std::pow(1.6, (0.9 - 0.09) / 0.99), 1e-3);
  }
  EXPECT_TRUE(TwoSidesOf(Sheets({{0, 1}, {1, 1.3}})).both_were_shown());
  EXPECT_FALSE(TwoSidesOf(Sheets({{0, 1}, {1, 1.7}})).both_were_shown());
  // Three: what is between is hardly seen.
  EXPECT_NEAR(TwoSidesOf(Sheets({{0, 1}, {1, 3}, {2, 1}})).coarser, 1, 1e-3);
}

TEST(TwoSides, NeitherUnitNorOrientationMatters) {
  GaussianCloud cloud = Sheets({{0, 1}, {1, 1.3}});
  const TwoSides before = TwoSidesOf(cloud);
  for (size_t i = 0; i < static_cast<size_t>(cloud.size()); ++i) {
    std::swap(cloud.means[3 * i], cloud.means[3 * i + 1]);
    for (size_t a = 0; a < 3; ++a) {
      cloud.means[3 * i + a] *= 1000;
      cloud.log_scales[3 * i + a] += std::log(1000.0f);
    }
  }
  const TwoSides after = TwoSidesOf(cloud);
  EXPECT_NEAR(after.shared, before.shared, 1e-3);
  EXPECT_NEAR(after.coarser, before.coarser, 1e-3);
}

TEST(TwoSides, OddClouds) {
  EXPECT_FALSE(TwoSidesOf({}).both_were_shown());
  GaussianCloud one = Sheets({{0, 1}});
  one = Subset(one, std::vector<int64_t>{0}).value();
  EXPECT_FALSE(TwoSidesOf(one).both_were_shown());
  GaussianCloud faint = Sheets({{0, 1}, {1, 1}});
  for (float& logit : faint.opacity_logits) logit = -20;
  EXPECT_FALSE(TwoSidesOf(faint).both_were_shown()) << "nothing is covered";
  GaussianCloud odd = Sheets({{0, 1}, {1, 1}});
  for (size_t a = 0; a < 4; ++a) odd.quats[a] = 0;
  odd.log_scales[3] = 80;
  odd.log_scales[6] = -80;
  odd.log_scales[9] = std::numeric_limits<float>::infinity();
  odd.opacity_logits[4] = std::nanf("");
  odd.means[15] = std::nanf("");
  const TwoSides sides = TwoSidesOf(odd);
  EXPECT_TRUE(std::isfinite(sides.shared) && std::isfinite(sides.coarser));
}

}  // namespace
}  // namespace anchorsplat
