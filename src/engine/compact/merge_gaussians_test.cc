#include "compact/merge_gaussians.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "core/random.h"

namespace anchorsplat {
namespace {

// An upright Gaussian that is far longer in depth z than the views along x and y could tell.
MergeGaussian At(double x, double y, double sx, double sy, double opacity) {
  MergeGaussian g;
  g.mean = {x, y, 0};
  g.covariance = {sx * sx, 0, 0, sy * sy, 0, 1};
  g.opacity = opacity;
  Measure(g);
  return g;
}

double Alpha(const MergeGaussian& g, double x, double y) {
  const double xx = g.covariance[0], xy = g.covariance[1], yy = g.covariance[3];
  const double dx = x - g.mean[0], dy = y - g.mean[1];
  const double power = (yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy);
  return g.opacity * std::exp(-0.5 * power);
}

// Over the plane that the view along z shows.
double Integral(const std::function<double(double, double)>& f) {
  constexpr double kStep = 0.1;
  double sum = 0;
  for (double x = -20; x <= 20; x += kStep) {
    for (double y = -20; y <= 20; y += kStep) sum += f(x, y) * kStep * kStep;
  }
  return sum;
}

TEST(MergeGaussians, AreasAndOverlapsAreIntegrals) {
  MergeGaussian a = At(0.5, -1, 2, 1, 1), b = At(-1, 0.3, 1.5, 1.2, 1);
  a.covariance[1] = 0.8;
  Measure(a);
  EXPECT_NEAR(a.area[2], Integral([&](double x, double y) { return Alpha(a, x, y); }), 1e-6);
  EXPECT_NEAR(Overlaps(a, b)[2], Integral([&](double x, double y) { return Alpha(a, x, y) * Alpha(b, x, y); }), 1e-6);
}

// Equal but for where they are, all moments are those of what they absorb together.
TEST(MergeGaussians, MomentsAreThoseOfWhatBothAbsorb) {
  for (const double opacity : {0.05, 0.4, 0.7}) {
    for (const double apart : {0.0, 1.0, 3.0}) {
      const MergeGaussian a = At(-apart / 2, 0, 2, 1.5, opacity), b = At(apart / 2, 0, 2, 1.5, opacity);
      const auto together = [&](double x, double y) { return 1 - (1 - Alpha(a, x, y)) * (1 - Alpha(b, x, y)); };
      const double mass = Integral(together);
      const double xx = Integral([&](double x, double y) { return x * x * together(x, y); }) / mass;
      const double yy = Integral([&](double x, double y) { return y * y * together(x, y); }) / mass;
      const MergedPair merged = MergePair(a, b, Overlaps(a, b));
      ASSERT_TRUE(merged.valid);
      const MergeGaussian& m = merged.gaussian;
      EXPECT_NEAR(m.mean[0], 0, 1e-9);
      EXPECT_NEAR(merged.share, 0.5, 1e-9);
      const double wider = m.opacity < kMostMergedOpacity ? 1 : m.covariance[3] / yy;
      // The views from the side overlap otherwise, and another shape has another mean over all directions.
      EXPECT_NEAR(m.covariance[0] / wider, xx, 0.05 * xx) << opacity << ' ' << apart;
      EXPECT_NEAR(m.covariance[3] / wider, yy, 0.05 * yy) << opacity << ' ' << apart;
      EXPECT_NEAR(m.opacity * m.area[2], mass, 0.1 * mass) << opacity << ' ' << apart;
    }
  }
}

// The difference of two pictures, pixel by pixel, of Gaussians that hardly overlap.
TEST(MergeGaussians, CostIsTheDifferenceOfThePictures) {
  const double red[2] = {0.8, 0.2};
  MergeGaussian a = At(-2, 0, 1.2, 1, 0.2), b = At(2, 0.5, 1, 1.3, 0.1);
  for (MergeGaussian* g : {&a, &b}) {  // a plate, so that all views are about the one along z
    g->covariance[5] = 1e-8;
    Measure(*g);
  }
  const auto overlaps = Overlaps(a, b);
  const MergedPair merged = MergePair(a, b, overlaps);
  ASSERT_TRUE(merged.valid);
  const MergeColors colors = {red[0] * red[0], red[0] * red[1], red[1] * red[1]};
  const double color = merged.share * red[0] + (1 - merged.share) * red[1];
  const double expected = Integral([&](double x, double y) {
    const double oa = Alpha(a, x, y), ob = Alpha(b, x, y), om = Alpha(merged.gaussian, x, y);
    const double of_color = oa * (red[0] - color) + ob * (red[1] - color), of_alpha = kBehind * (oa + ob - om);
    return of_color * of_color + 3 * of_alpha * of_alpha;
  });
  EXPECT_NEAR(9 * MergeCost(a, b, overlaps, merged, colors), expected, 0.02 * expected);
}

TEST(MergeGaussians, EqualOnesMergeForAlmostNothing) {
  const MergeGaussian a = At(1, 2, 3, 2, 0.3);
  const auto overlaps = Overlaps(a, a);
  const MergedPair merged = MergePair(a, a, overlaps);
  const double equal = MergeCost(a, a, overlaps, merged, {1, 1, 1});
  EXPECT_LT(equal, 0.001);
  const MergeGaussian other = At(4, 2, 3, 2, 0.3);
  const auto apart = Overlaps(a, other);
  const MergedPair both = MergePair(a, other, apart);
  const double moved = MergeCost(a, other, apart, both, {1, 1, 1});
  EXPECT_GT(moved, 5 * equal);
  EXPECT_GT(MergeCost(a, other, apart, both, {1, 0, 1}), 5 * moved);  // of two colours
}

// The part of o·exp(−r²/2) that is 1/255 and more.
TEST(MergeGaussians, WhatIsSeenOfAGaussianIsItsBrightPart) {
  for (const double opacity : {0.005, 0.01, 0.03, 0.2, 0.99}) {
    double mass = 0, square = 0;
    for (double r = 0.0005; r < 6; r += 0.001) {
      const double alpha = opacity * std::exp(-0.5 * r * r);
      if (alpha < 1.0 / 255) break;
      mass += alpha * r;
      square += alpha * r * r * r / 2;  // of one of two axes
    }
    EXPECT_NEAR(VisibleVarianceShare(opacity), square / mass, 2e-3) << opacity;
    EXPECT_NEAR(mass * 0.001, opacity - 1.0 / 255, 1e-4) << opacity;
  }
  EXPECT_GT(VisibleVarianceShare(0), 0);
}

// Against the mean over directions of the plane's area.
TEST(MergeGaussians, MeanAreaIsThatOverAllDirections) {
  Random random(5);
  for (const std::array<double, 3>& s : {std::array<double, 3>{1, 1, 1}, {5, 5, 0.1}, {9, 0.2, 0.2}, {4, 2, 1}}) {
    MergeGaussian g;
    g.covariance = {s[0] * s[0], 0, 0, s[1] * s[1], 0, s[2] * s[2]};
    Measure(g);
    double sum = 0;
    constexpr int kDirections = 20000;
    for (int i = 0; i < kDirections; ++i) {
      const double x = random.Normal(), y = random.Normal(), z = random.Normal();
      const double a = s[1] * s[2] * x, b = s[0] * s[2] * y, c = s[0] * s[1] * z;
      sum += 2 * 3.14159265358979 * std::sqrt((a * a + b * b + c * c) / (x * x + y * y + z * z));
    }
    EXPECT_NEAR(g.mean_area, sum / kDirections, 0.03 * sum / kDirections) << s[0] << ' ' << s[1] << ' ' << s[2];
  }
}

TEST(MergeGaussians, ExtremesAreNoMerge) {
  const MergeGaussian a = At(0, 0, 1, 1, 0.5), none = At(0, 0, 1, 1, 0);
  EXPECT_FALSE(MergePair(none, none, Overlaps(none, none)).valid);
  const MergedPair with_none = MergePair(a, none, Overlaps(a, none));
  EXPECT_TRUE(with_none.valid);
  EXPECT_EQ(with_none.share, 1);
  EXPECT_NEAR(with_none.gaussian.opacity, 0.5, 1e-12);
  for (const MergeGaussian& odd : {At(1e300, 0, 1, 1, 0.5), At(0, 0, 1e200, 1, 0.5), At(NAN, 0, 1, 1, 0.5),
                                   At(0, 0, 1, 1, NAN), At(0, 0, INFINITY, 1, 0.5)}) {
    EXPECT_FALSE(MergePair(a, odd, Overlaps(a, odd)).valid);
    EXPECT_FALSE(MergePair(odd, a, Overlaps(odd, a)).valid);
  }
}

}  // namespace
}  // namespace anchorsplat
