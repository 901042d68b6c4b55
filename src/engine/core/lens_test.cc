#include "core/lens.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace anchorsplat {
namespace {

std::vector<Lens> Lenses() {
  return {
      {.model = LensModel::kRadial, .radial = {-0.28, 0.07, 0, 0}, .tangential = {0.001, -0.002}},
      {.model = LensModel::kRadial, .radial = {0.2, 0.05, 0.01, 0.002}},
      {.model = LensModel::kRadial, .radial = {0.1, 0.02, 0.01, 0}, .denominator = {0.2, 0.1, 0.05}},
      {.model = LensModel::kFisheye, .radial = {0.02, -0.01, 0.004, -0.001}},
      {.model = LensModel::kFisheye},
      {.model = LensModel::kRadial, .radial = {-0.28, 0.07, 0, 0}, .tangential = {0.001, -0.002}, .skew = 0.01},
      {.model = LensModel::kRadial, .skew = -0.2},
  };
}

TEST(Lens, UndistortIsTheInverse) {
  for (const Lens& lens : Lenses()) {
    const LensInverse inverse(lens);
    for (double angle = 0; angle < 6.3; angle += 0.37) {
      for (double r : {0.0, 1e-9, 0.01, 0.3, 0.7, 0.95}) {
        if (r > inverse.largest_radius()) continue;
        const PlanePoint p = {r * std::cos(angle), r * std::sin(angle)};
        const auto back = inverse.Undistort(Distort(lens, p));
        ASSERT_TRUE(back.has_value()) << r;
        EXPECT_NEAR((*back)[0], p[0], 1e-9);
        EXPECT_NEAR((*back)[1], p[1], 1e-9);
      }
    }
  }
}

// By the formulas, with numbers worked out by hand.
TEST(Lens, KnownPoints) {
  const Lens radial{.model = LensModel::kRadial, .radial = {0.1, 0.2, 0, 0}, .tangential = {0.01, 0.02}};
  const PlanePoint d = Distort(radial, {1, 2});  // r² = 5, s = 1 + 0.5 + 5
  EXPECT_NEAR(d[0], 6.5 + 0.04 + 0.02 * 7, 1e-12);
  EXPECT_NEAR(d[1], 13 + 0.08 + 0.01 * 13, 1e-12);
  Lens skewed = radial;
  skewed.skew = 0.5;
  EXPECT_NEAR(Distort(skewed, {1, 2})[0], d[0] + 0.5 * d[1], 1e-12);
  EXPECT_EQ(Distort(skewed, {1, 2})[1], d[1]);
  EXPECT_FALSE((Lens{.model = LensModel::kRadial, .skew = 1e-9}.IsIdentity()));
  const PlanePoint f = Distort({.model = LensModel::kFisheye, .radial = {0.1, 0, 0, 0}}, {0, 1});
  EXPECT_NEAR(f[1], M_PI / 4 * (1 + 0.1 * M_PI * M_PI / 16), 1e-12);
  EXPECT_NEAR(f[0], 0, 1e-15);
}

TEST(Lens, NothingIsFoundWhereTheModelFoldsBack) {
  // r − 0.5·r³ rises to r = √(2/3) and falls from there.
  const LensInverse folded({.model = LensModel::kRadial, .radial = {-0.5, 0, 0, 0}});
  EXPECT_NEAR(folded.largest_radius(), std::sqrt(2.0 / 3), 1e-3);
  EXPECT_FALSE(folded.Undistort({0.6, 0}).has_value());
  EXPECT_TRUE(folded.Undistort({0.5, 0}).has_value());
  const LensInverse fisheye({.model = LensModel::kFisheye});
  EXPECT_FALSE(fisheye.Undistort({1.6, 0}).has_value()) << "behind 90 degrees";
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL, 1e308}) {
    EXPECT_FALSE(fisheye.Undistort({bad, 0}).has_value());
    EXPECT_FALSE(folded.Undistort({0, bad}).has_value());
  }
  const LensInverse none({.model = LensModel::kRadial, .radial = {-1e30, 0, 0, 0}});
  EXPECT_FALSE(none.Undistort({0.1, 0.1}).has_value());
  EXPECT_TRUE(Lens{}.IsIdentity());
  EXPECT_FALSE((Lens{.model = LensModel::kFisheye}).IsIdentity());
}

}  // namespace
}  // namespace anchorsplat
