#include "metrics/color_correction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/parallel.h"
#include "core/random.h"
#include "metrics/image_metrics.h"

namespace anchorsplat {
namespace {

Image RandomColors(int width, int height, uint64_t seed, int channels = 3) {
  Image image(width, height, channels);
  Random random(seed);
  for (float& x : image.pixels) x = static_cast<float>(0.2 + 0.5 * random.Uniform());
  return image;
}

Image Mapped(const ColorMap& map, const Image& image) {
  Image out = image;
  ApplyColors(map, out);
  return out;
}

Image Noisy(Image image, double size, uint64_t seed) {
  Random random(seed);
  for (float& x : image.pixels) x = static_cast<float>(std::clamp(x + size * random.Normal(), 0.0, 1.0));
  return image;
}

// The normal equations of 12 unknowns as they stand, by elimination with pivots: no means taken out, no ridge.
ColorMap LeastSquares(const Image& image, const Image& truth) {
  double a[4][7] = {};
  for (int64_t i = 0; i < image.plane(); ++i) {
    const double x[4] = {image.channel(0)[i], image.channel(1)[i], image.channel(2)[i], 1};
    for (int r = 0; r < 4; ++r) {
      for (int c = 0; c < 4; ++c) a[r][c] += x[r] * x[c];
      for (int c = 0; c < 3; ++c) a[r][4 + c] += x[r] * truth.channel(c)[i];
    }
  }
  for (int k = 0; k < 4; ++k) {
    int pivot = k;
    for (int r = k; r < 4; ++r) pivot = std::abs(a[r][k]) > std::abs(a[pivot][k]) ? r : pivot;
    std::swap(a[k], a[pivot]);
    for (int r = 0; r < 4; ++r) {
      if (r == k) continue;
      const double factor = a[r][k] / a[k][k];
      for (int c = k; c < 7; ++c) a[r][c] -= factor * a[k][c];
    }
  }
  ColorMap map;
  for (size_t c = 0; c < 3; ++c) {
    for (size_t k = 0; k < 3; ++k) map.matrix[3 * c + k] = a[k][4 + c] / a[k][k];
    map.offset[c] = a[3][4 + c] / a[3][3];
  }
  return map;
}

void ExpectNear(const ColorMap& a, const ColorMap& b, double tolerance) {
  for (size_t k = 0; k < 9; ++k) EXPECT_NEAR(a.matrix[k], b.matrix[k], tolerance) << k;
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(a.offset[k], b.offset[k], tolerance) << k;
}

TEST(ColorCorrection, MatchesTheNormalEquations) {
  for (uint64_t seed = 0; seed < 10; ++seed) {
    const Image image = RandomColors(211, 173, seed), truth = RandomColors(211, 173, seed + 100);
    ExpectNear(FitColors(image, truth).value(), LeastSquares(image, truth), 1e-5);
    const Image related = Noisy(image, 0.05, seed);
    ExpectNear(FitColors(image, related).value(), LeastSquares(image, related), 1e-5);
  }
}

TEST(ColorCorrection, TakesBackWhatACameraDid) {
  const ColorMap camera = {{0.9, 0.05, 0, -0.03, 1.1, 0.02, 0, 0.04, 0.8}, {0.02, -0.01, 0.03}};
  const Image image = RandomColors(64, 48, 1), truth = Mapped(camera, image);
  ExpectNear(FitColors(image, truth).value(), camera, 1e-4);
  EXPECT_LT(Psnr(image, truth).value(), 35);
  EXPECT_GT(Psnr(Mapped(FitColors(image, truth).value(), image), truth).value(), 90);
}

TEST(ColorCorrection, NeverLosesAgainstThePlainPicture) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const Image image = RandomColors(33, 21, seed);
    for (const double noise : {1e-4, 0.01, 0.3}) {
      const Image truth = Noisy(image, noise, seed + 7);
      EXPECT_GE(Psnr(Mapped(FitColors(image, truth).value(), image), truth).value() + 1e-4, Psnr(image, truth).value());
    }
  }
}

TEST(ColorCorrection, OneColourIsShifted) {
  Image plain(40, 30, 3), truth = RandomColors(40, 30, 3);
  for (float& x : plain.pixels) x = 0.25f;
  const ColorMap map = FitColors(plain, truth).value();
  for (size_t k = 0; k < 9; ++k) EXPECT_NEAR(map.matrix[k], k % 4 == 0 ? 1 : 0, 1e-6);
  EXPECT_GT(Psnr(Mapped(map, plain), truth).value(), Psnr(plain, truth).value());
  // The other way round: the colour is met, and nothing explodes.
  const Image flat = Mapped(FitColors(truth, plain).value(), truth);
  EXPECT_GT(Psnr(flat, plain).value(), 90);
  for (const float x : flat.pixels) ASSERT_TRUE(x >= 0 && x <= 1);
  // Almost one colour: what the rounding of a few bits says is not magnified.
  const ColorMap nearly = FitColors(Noisy(plain, 1e-6, 4), truth).value();
  for (const double m : nearly.matrix) EXPECT_LT(std::abs(m), 5);
}

TEST(ColorCorrection, GreyPicturesStayGrey) {
  Image grey = RandomColors(50, 40, 5);
  for (int c = 1; c < 3; ++c) std::copy_n(grey.channel(0), grey.plane(), grey.channel(c));
  Image brighter = grey;
  for (float& x : brighter.pixels) x = 1.2f * x + 0.05f;
  const Image corrected = Mapped(FitColors(grey, brighter).value(), grey);
  EXPECT_GT(Psnr(corrected, brighter).value(), 80);
}

TEST(ColorCorrection, ExtremesAndRefusals) {
  Image image = RandomColors(8, 8, 1), truth = RandomColors(8, 8, 2);
  image.pixels[5] = std::numeric_limits<float>::quiet_NaN();
  ExpectNear(FitColors(image, truth).value(), ColorMap{}, 0);
  const Image one = RandomColors(1, 1, 1), other = RandomColors(1, 1, 2);
  EXPECT_GT(Psnr(Mapped(FitColors(one, other).value(), one), other).value(), 90);
  EXPECT_FALSE(FitColors(RandomColors(8, 8, 1), RandomColors(8, 9, 1)).ok());
  EXPECT_FALSE(FitColors(RandomColors(8, 8, 1, 1), RandomColors(8, 8, 1, 1)).ok());
  EXPECT_FALSE(FitColors(Image(), Image()).ok());
  // Alpha is none of the colours.
  const Image four = RandomColors(8, 8, 3, 4);
  const Image mapped = Mapped(FitColors(four, RandomColors(8, 8, 4, 4)).value(), four);
  EXPECT_TRUE(std::equal(four.channel(3), four.channel(3) + 64, mapped.channel(3)));
}

TEST(ColorCorrection, TheSameBitsForAnyNumberOfThreads) {
  const Image image = RandomColors(400, 300, 8), truth = RandomColors(400, 300, 9);
  SetThreadCount(1);
  const ColorMap alone = FitColors(image, truth).value();
  SetThreadCount(0);
  const ColorMap together = FitColors(image, truth).value();
  EXPECT_EQ(alone.matrix, together.matrix);
  EXPECT_EQ(alone.offset, together.offset);
}

}  // namespace
}  // namespace anchorsplat
