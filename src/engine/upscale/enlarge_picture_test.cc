#include "upscale/enlarge_picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "io/folder_for_test.h"
#include "metrics/bicubic.h"
#include "upscale/small_upscaler_for_test.h"

namespace anchorsplat {
namespace {

using ::testing::HasSubstr;

// A ball of one colour, transparent around it, with a soft edge.
Image Ball(const std::array<float, 3>& color) {
  Image out(12, 10, 4);
  for (int y = 0; y < 10; ++y) {
    for (int x = 0; x < 12; ++x) {
      const double distance = std::hypot(x - 5.5, y - 4.5);
      for (int c = 0; c < 3; ++c) out.at(c, y, x) = color[static_cast<size_t>(c)];
      out.at(3, y, x) = static_cast<float>(std::clamp(4 - distance, 0.0, 1.0));
    }
  }
  return out;
}

TEST(EnlargePicture, RepeatsPixelsWithANetworkThatDoes) {
  Upscaler upscaler = OpenedForTest(RepeatingForTest());
  for (const std::array<float, 3> background : {std::array{0.0f, 0.0f, 0.0f}, {1.0f, 1.0f, 1.0f}, {0.2f, 0.5f, 0.5f}}) {
    for (const int factor : {0, 4}) {
      const Image ball = Ball({0.9f, 0.5f, 0.1f});
      const auto out = EnlargePicture(upscaler, ball, {.factor = factor, .background = background});
      ASSERT_TRUE(out.ok()) << out.error().message;
      const int times = factor == 0 ? 2 : 4;
      ASSERT_EQ(out->width, 12 * times);
      ASSERT_EQ(out->channels, 4);
      for (int y = 0; y < out->height; ++y) {
        for (int x = 0; x < out->width; ++x) {
          const float alpha = ball.at(3, y / times, x / times);
          ASSERT_NEAR(out->at(3, y, x), alpha, 1e-6);
          for (int c = 0; c < 3; ++c) {  // as at the border as in the middle, whatever it is put over
            ASSERT_NEAR(out->at(c, y, x), alpha > 0 ? ball.at(c, y / times, x / times) : 0.0f, 1e-5) << x << " " << y;
          }
        }
      }
    }
  }
}

TEST(EnlargePicture, AlphaBicubically) {
  Upscaler upscaler = OpenedForTest(RepeatingForTest());
  const Image ball = Ball({1, 1, 1});
  Image alpha(12, 10, 1);
  std::copy_n(ball.channel(3), ball.plane(), alpha.channel(0));
  const Image expected = *EnlargeBicubic(alpha, 24, 20);
  const auto out = EnlargePicture(upscaler, ball, {.alpha = AlphaEnlargement::kBicubic});
  ASSERT_TRUE(out.ok());
  for (int64_t i = 0; i < out->plane(); ++i) {
    ASSERT_EQ(out->channel(3)[i], std::clamp(expected.channel(0)[i], 0.0f, 1.0f));
  }
}

TEST(EnlargePicture, SolidAlphaIsThatOfColoursAlone) {
  Upscaler upscaler = OpenedForTest(SpanForTest(5, 2));
  Image solid = Ball({0.3f, 0.6f, 0.9f});
  for (int c = 0; c < 3; ++c) {
    for (int64_t i = 0; i < solid.plane(); ++i) solid.channel(c)[i] *= solid.channel(3)[i];
  }
  std::fill_n(solid.channel(3), solid.plane(), 1.0f);
  Image colors(12, 10, 3);
  std::copy_n(solid.channel(0), 3 * solid.plane(), colors.channel(0));
  const Image with = *EnlargePicture(upscaler, solid), without = *EnlargePicture(upscaler, colors);
  for (int64_t i = 0; i < 3 * without.plane(); ++i)
    ASSERT_NEAR(with.pixels[static_cast<size_t>(i)], without.channel(0)[i], 1e-6);
  for (int64_t i = 0; i < with.plane(); ++i) ASSERT_EQ(with.channel(3)[i], 1);
}

TEST(EnlargePicture, StaysWithinItsRange) {
  Upscaler upscaler = OpenedForTest(SpanForTest(5, 2));
  const Image out = *EnlargePicture(upscaler, Ball({1, 0, 1}));
  for (const float value : out.pixels) {
    ASSERT_GE(value, 0);
    ASSERT_LE(value, 1);
  }
}

TEST(TimesOf, PowersOfTheScale) {
  EXPECT_EQ(*TimesOf(0, 3), 1);
  EXPECT_EQ(*TimesOf(8, 2), 3);
  EXPECT_EQ(*TimesOf(16, 4), 2);
  for (const int factor : {1, 3, 6, 32, -2})
    EXPECT_EQ(TimesOf(factor, 2).error().code, ErrorCode::kBadArgument) << factor;
  EXPECT_THAT(TimesOf(6, 2).error().message, HasSubstr("possible: 2, 4, 8, 16"));
}

}  // namespace
}  // namespace anchorsplat
