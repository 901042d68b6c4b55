#include "enhance/downscale_look.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace anchorsplat {
namespace {

// Faint balls that hardly overlap, so that what they cover adds up.
GaussianCloud FaintBalls(double sigma, double at_scale = 1) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(-1, 1);
  GaussianCloud cloud;
  cloud.Resize(200, 0);
  for (int64_t i = 0; i < cloud.size(); ++i) {
    for (int64_t c = 0; c < 3; ++c) {
      cloud.means[static_cast<size_t>(3 * i + c)] = static_cast<float>(at_scale) * place(random);
      cloud.log_scales[static_cast<size_t>(3 * i + c)] = static_cast<float>(std::log(at_scale * sigma));
      cloud.sh[static_cast<size_t>(3 * i + c)] = 0.5f;
    }
    cloud.quats[static_cast<size_t>(4 * i)] = 1;
    std::fill_n(cloud.quats.begin() + 4 * i + 1, 3, 0.0f);
    cloud.opacity_logits[static_cast<size_t>(i)] = -1.5f;
  }
  return cloud;
}

DownscaleLook LookAtPixels(const GaussianCloud& cloud, double size, RenderMode mode) {
  auto probe = DownscaleProbe::Make(FindTellingGaussians(cloud));
  EXPECT_TRUE(probe.ok());
  const auto look = probe->At(size, mode);
  EXPECT_TRUE(look.ok());
  return *look;
}

// Balls lie nearer and farther than the middle, and overlap a little: a tenth.
// A ball of σ covers σ² + 0.3 p² of a classic picture of pixels p, but for a factor.
TEST(DownscaleLook, AreaIsThatOfTheVariances) {
  const double sigma = 0.02;
  for (const double p : {0.04, 0.06}) {
    const DownscaleLook look = LookAtPixels(FaintBalls(sigma), p, RenderMode::kClassic);
    const double low = sigma * sigma + 0.3 * p * p;
    EXPECT_NEAR(look[3], std::log((sigma * sigma + 0.3 * p * p / 16) / low), 0.1) << p;
    // The filter gives back what the closer view's own pixels do not add.
    const double given = (1 - (1 - 1 / 16.0) / 3.6) * 0.3 * p * p;
    EXPECT_NEAR(look[0], std::log((sigma * sigma + given) / low), 0.1) << p;
    EXPECT_LT(look[1], look[4]) << p;
  }
}

TEST(DownscaleLook, NothingChangesAtPixelsThatAreMuchSmaller) {
  for (const RenderMode mode : {RenderMode::kClassic, RenderMode::kAntialiased}) {
    for (const double value : LookAtPixels(FaintBalls(0.1), 0.005, mode)) EXPECT_NEAR(value, 0, 0.01);
  }
}

// What an antialiased picture shows has the same weight at every size.
TEST(DownscaleLook, AntialiasedPicturesKeepTheirWeight) {
  EXPECT_NEAR(LookAtPixels(FaintBalls(0.02), 0.04, RenderMode::kAntialiased)[3], 0, 0.06);
}

TEST(DownscaleLook, ScalesWithTheCloud) {
  const DownscaleLook one = LookAtPixels(FaintBalls(0.02), 0.04, RenderMode::kClassic);
  const DownscaleLook large = LookAtPixels(FaintBalls(0.02, 1000), 40, RenderMode::kClassic);
  for (size_t k = 0; k < one.size(); ++k) EXPECT_NEAR(one[k], large[k], 2e-3) << k;
}

TEST(DownscaleLook, ASecondLookIsTheFirst) {
  auto probe = DownscaleProbe::Make(FindTellingGaussians(FaintBalls(0.02)));
  ASSERT_TRUE(probe.ok());
  const auto first = probe->At(0.04, RenderMode::kClassic);
  ASSERT_TRUE(probe->At(0.2, RenderMode::kAntialiased).ok());
  EXPECT_EQ(*first, *probe->At(0.04, RenderMode::kClassic));
}

TEST(DownscaleLook, OfNothingIsZero) {
  GaussianCloud faint = FaintBalls(0.02);
  std::fill(faint.opacity_logits.begin(), faint.opacity_logits.end(), -20.0f);
  for (const double value : LookAtPixels(faint, 0.04, RenderMode::kClassic)) EXPECT_EQ(value, 0);
}

}  // namespace
}  // namespace anchorsplat
