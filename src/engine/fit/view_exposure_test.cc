#include "fit/view_exposure.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"

namespace anchorsplat {
namespace {

Image RandomImage(uint64_t seed) {
  Image image(150, 131, 3);
  Random random(seed);
  for (float& x : image.pixels) x = static_cast<float>(random.Uniform());
  return image;
}

Image Exposed(const Image& image, const ViewExposure& exposure) {
  Image out = image;
  for (int c = 0; c < 3; ++c) {
    const auto k = static_cast<size_t>(c);
    for (int64_t i = 0; i < out.plane(); ++i) {
      out.channel(c)[i] = static_cast<float>(exposure.gain[k] * out.channel(c)[i] + exposure.bias[k]);
    }
  }
  return out;
}

TEST(ViewExposure, IsFoundAndRemoved) {
  const Image scene = RandomImage(1);
  const ViewExposure truth{{1.2, 0.8, 1.0}, {-0.05, 0.1, 0.0}};
  Image photograph = Exposed(scene, truth);
  const auto found = EstimateExposure(scene, photograph);
  ASSERT_TRUE(found.ok());
  for (size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(found->gain[c], truth.gain[c], 2e-3);
    EXPECT_NEAR(found->bias[c], truth.bias[c], 2e-3);
  }
  RemoveExposure(*found, photograph);
  for (size_t i = 0; i < scene.pixels.size(); i += 101) EXPECT_NEAR(photograph.pixels[i], scene.pixels[i], 4e-3);
}

TEST(ViewExposure, PlainPicturesSayNothingAboutGain) {
  Image scene(20, 20, 3), photograph(20, 20, 3);
  std::fill(scene.pixels.begin(), scene.pixels.end(), 0.5f);
  std::fill(photograph.pixels.begin(), photograph.pixels.end(), 0.5f);
  const auto same = EstimateExposure(scene, photograph);
  EXPECT_NEAR(same->gain[1], 1, 1e-9);
  EXPECT_NEAR(same->bias[1], 0, 1e-9);
  std::fill(scene.pixels.begin(), scene.pixels.end(), 0.0f);
  const auto black = EstimateExposure(scene, photograph);
  EXPECT_NEAR(black->gain[1], 1, 1e-9);
  EXPECT_NEAR(black->bias[1], 0.5, 1e-3);
  EXPECT_FALSE(EstimateExposure(scene, Image(20, 21, 3)).ok());
}

TEST(IgnoreOutliers, LeavesNoiseAndTakesAPasserBy) {
  const Image scene = RandomImage(2);
  Image photograph = scene;
  Random random(3);
  for (float& x : photograph.pixels) x += static_cast<float>(0.03 * random.Normal());
  const Image noisy = photograph;
  for (int c = 0; c < 3; ++c) {
    for (int y = 30; y < 60; ++y) {
      for (int x = 40; x < 50; ++x) photograph.at(c, y, x) = 3;
    }
  }
  const auto ignored = IgnoreOutliers(scene, 0.1f, photograph);
  ASSERT_TRUE(ignored.ok());
  EXPECT_EQ(*ignored, 300);
  for (int y = 0; y < scene.height; ++y) {
    for (int x = 0; x < scene.width; ++x) {
      const bool inside = x >= 40 && x < 50 && y >= 30 && y < 60;
      EXPECT_EQ(photograph.at(2, y, x), (inside ? scene : noisy).at(2, y, x));
    }
  }
  Image same = scene;
  EXPECT_EQ(*IgnoreOutliers(scene, 0.1f, same), 0);
  Image other(3, 3, 3);
  EXPECT_FALSE(IgnoreOutliers(scene, 0.1f, other).ok());
}

}  // namespace
}  // namespace anchorsplat
