#include "metrics/bicubic.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/random.h"

namespace anchorsplat {
namespace {

Image Noise(int width, int height, int channels) {
  Image image(width, height, channels);
  Random random(3);
  for (float& value : image.pixels) value = static_cast<float>(random.Uniform());
  return image;
}

// The two-dimensional sum over 4 × 4 neighbours, kernel by its definition.
double Reference(const Image& image, int c, int y, int x, int width, int height) {
  const auto kernel = [](double t) {
    t = std::abs(t);
    if (t <= 1) return 1.5 * t * t * t - 2.5 * t * t + 1;
    return t < 2 ? -0.5 * t * t * t + 2.5 * t * t - 4 * t + 2 : 0.0;
  };
  const double u = (x + 0.5) * image.width / width - 0.5, v = (y + 0.5) * image.height / height - 0.5;
  double sum = 0;
  for (int j = static_cast<int>(std::floor(v)) - 1; j <= std::floor(v) + 2; ++j) {
    for (int i = static_cast<int>(std::floor(u)) - 1; i <= std::floor(u) + 2; ++i) {
      const float value = image.at(c, std::clamp(j, 0, image.height - 1), std::clamp(i, 0, image.width - 1));
      sum += kernel(u - i) * kernel(v - j) * static_cast<double>(value);
    }
  }
  return sum;
}

TEST(EnlargeBicubic, MatchesTheDefinition) {
  for (const auto& [w, h, width, height] :
       {std::array{7, 5, 28, 20}, std::array{5, 9, 13, 9}, std::array{1, 3, 4, 17}, std::array{6, 2, 7, 11}}) {
    const Image image = Noise(w, h, 3);
    const auto large = EnlargeBicubic(image, width, height);
    ASSERT_TRUE(large.ok());
    ASSERT_EQ(large->width, width);
    ASSERT_EQ(large->height, height);
    for (int c = 0; c < 3; ++c) {
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          ASSERT_NEAR(large->at(c, y, x), Reference(image, c, y, x, width, height), 2e-6) << c << " " << y << " " << x;
        }
      }
    }
  }
}

TEST(EnlargeBicubic, KeepsTheSameSizeConstantsAndSlopes) {
  const Image image = Noise(6, 4, 1);
  EXPECT_EQ(EnlargeBicubic(image, 6, 4)->pixels, image.pixels);
  Image slope(8, 8, 1);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) slope.at(0, y, x) = 0.1f * static_cast<float>(x);
  }
  const Image large = *EnlargeBicubic(slope, 32, 32);
  for (int x = 10; x < 22; ++x) EXPECT_NEAR(large.at(0, 5, x), 0.1 * ((x + 0.5) / 4 - 0.5), 1e-6);
}

TEST(EnlargeBicubic, RefusesOtherSizes) {
  EXPECT_FALSE(EnlargeBicubic(Noise(6, 4, 1), 5, 8).ok());
  EXPECT_FALSE(EnlargeBicubic(Noise(6, 4, 1), 12, 3).ok());
  EXPECT_FALSE(EnlargeBicubic(Image(), 8, 8).ok());
  EXPECT_FALSE(EnlargeBicubic(Noise(6, 4, 1), kMaxImageSide, kMaxImageSide).ok());
}

}  // namespace
}  // namespace anchorsplat
