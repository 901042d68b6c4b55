#include "scene/texture_pyramid.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/random.h"

namespace anchorsplat {
namespace {

Texture RandomTexture(int width, int height, bool alpha, uint64_t seed) {
  Random random(seed);
  Texture texture{"noise", width, height, alpha, {}};
  texture.rgba.resize(static_cast<size_t>(4 * width * height));
  for (size_t i = 0; i < texture.rgba.size(); ++i) {
    texture.rgba[i] = i % 4 == 3 && !alpha ? uint8_t{255} : static_cast<uint8_t>(random.Below(256));
  }
  return texture;
}

TEST(TexturePyramid, TheTopIsTheMeanWhateverTheSize) {
  for (const auto& [width, height] : {std::pair{64, 64}, {17, 5}, {1, 33}, {7, 1}, {3, 3}}) {
    const Texture texture = RandomTexture(width, height, false, 7);
    const TexturePyramid pyramid(texture);
    double mean = 0;
    for (size_t i = 0; i < texture.rgba.size(); i += 4) mean += texture.rgba[i];
    mean /= 255.0 * width * height;
    // Every level rounds to 1/255.
    EXPECT_NEAR(pyramid.Sample(0.3f, 0.8f, 99)[0], mean, 0.5 * pyramid.levels() / 255) << width << " x " << height;
  }
}

TEST(TexturePyramid, ReadsTexelCentresExactlyAndRepeats) {
  const Texture texture = RandomTexture(5, 3, true, 3);
  const TexturePyramid pyramid(texture);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 5; ++x) {
      const float u = (static_cast<float>(x) + 0.5f) / 5, v = 1 - (static_cast<float>(y) + 0.5f) / 3;
      for (const float turn : {0.0f, 1.0f, -3.0f}) {
        const auto color = pyramid.Sample(u + turn, v - turn, 0);
        for (size_t c = 0; c < 4; ++c) {
          EXPECT_NEAR(color[c], texture.rgba[static_cast<size_t>(4 * (5 * y + x)) + c] / 255.0f, 1e-5f);
        }
        EXPECT_EQ(pyramid.SampleAlpha(u + turn, v - turn, 0), color[3]);
      }
    }
  }
}

TEST(TexturePyramid, BlendsAcrossTheSeam) {
  const TexturePyramid pyramid(Texture{"two", 2, 1, false, {0, 0, 0, 255, 255, 255, 255, 255}});
  EXPECT_NEAR(pyramid.Sample(0, 0.5f, 0)[0], 0.5f, 1e-6f);
  EXPECT_NEAR(pyramid.Sample(0.5f, 0.5f, 0)[0], 0.5f, 1e-6f);
  EXPECT_NEAR(pyramid.Sample(-1e-12f, 0.5f, 0)[0], 0.5f, 1e-6f);  // rounds to 1 when its whole part is taken off
}

TEST(TexturePyramid, TransparentTexelsDoNotBleed) {
  // Green that cannot be seen beside red: the smaller copy is red, half transparent.
  const TexturePyramid pyramid(Texture{"leaf", 2, 1, true, {0, 255, 0, 0, 255, 0, 0, 255}});
  const auto color = pyramid.Sample(0.5f, 0.5f, 1);
  EXPECT_EQ(color[0], 1);
  EXPECT_EQ(color[1], 0);
  EXPECT_NEAR(color[3], 0.5f, 0.003f);
}

TEST(TexturePyramid, LevelIsThatOfTheNearestTexelSize) {
  EXPECT_EQ(LevelOfFootprint(0), 0);
  EXPECT_EQ(LevelOfFootprint(-1), 0);
  EXPECT_EQ(LevelOfFootprint(std::numeric_limits<float>::quiet_NaN()), 0);
  EXPECT_EQ(LevelOfFootprint(1.9f), 0);  // below 2: nearer to one texel than to four
  EXPECT_EQ(LevelOfFootprint(2.1f), 1);
  EXPECT_EQ(LevelOfFootprint(7.9f), 1);
  EXPECT_EQ(LevelOfFootprint(8.1f), 2);
  EXPECT_EQ(LevelOfFootprint(1 << 20), 10);
  EXPECT_GT(LevelOfFootprint(std::numeric_limits<float>::infinity()), 20);
}

}  // namespace
}  // namespace anchorsplat
