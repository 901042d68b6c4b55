#include "metrics/side_by_side.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/random.h"
#include "metrics/caption_text.h"

namespace anchorsplat {
namespace {

Image Filled(int width, int height, int channels, float value) {
  Image image(width, height, channels);
  std::fill(image.pixels.begin(), image.pixels.end(), value);
  return image;
}

Image NoiseImage(int width, int height, uint64_t seed) {
  Image image(width, height, 3);
  Random random(seed);
  for (float& x : image.pixels) x = static_cast<float>(random.Uniform());
  return image;
}

TEST(CaptionText, DrawsInsideOnly) {
  Image image = Filled(40, 9, 3, 0);
  DrawText(image, 1, 1, "I", 1, {1, 0.5f, 0});
  const char* expected[] = {"###", ".#.", ".#.", ".#.", ".#.", ".#.", "###"};
  for (int y = 0; y < 7; ++y) {
    for (int x = 0; x < 3; ++x) EXPECT_EQ(image.at(0, y + 1, x + 1), expected[y][x] == '#' ? 1.0f : 0.0f) << y << x;
  }
  EXPECT_EQ(image.at(1, 1, 2), 0.5f);
  EXPECT_EQ(TextWidth("I", 3), 12);
  EXPECT_EQ(TextWidth("II", 3), 2 * 12 + 3);
  EXPECT_EQ(TruncatedText("IIII", TextWidth("III", 2), 2, ""), "III");
  EXPECT_EQ(TruncatedText("a long one", TextWidth("a lo...", 1), 1), "a lo...");
  EXPECT_EQ(TextWidth("", 3), 0);
  // Far outside, and bytes that no glyph stands for.
  DrawText(image, -20, -3, "long text that leaves on the right \x01\xff", 2, {1, 1, 1});
  DrawText(image, 1000, 1000, "x", 5, {1, 1, 1});
}

TEST(MostDifferentRegion, FindsTheDisturbance) {
  const Image a = NoiseImage(60, 50, 1);
  Image b = a;
  for (int y = 20; y < 24; ++y) {
    for (int x = 41; x < 49; ++x) b.at(1, y, x) += b.at(1, y, x) < 0.5f ? 0.4f : -0.4f;
  }
  const ViewRegion region = MostDifferentRegion(a, b, 8, 4);
  EXPECT_EQ(region.x, 41);
  EXPECT_EQ(region.y, 20);
  EXPECT_EQ(region.width, 8);
  EXPECT_EQ(region.height, 4);
}

TEST(MostDifferentRegion, OfEqualPicturesIsTheMostDetailed) {
  Image image = Filled(40, 30, 3, 0.5f);
  for (int y = 10; y < 16; ++y) {
    for (int x = 25; x < 31; ++x) image.at(0, y, x) = (x + y) % 2 ? 1.0f : 0.0f;
  }
  const ViewRegion region = MostDifferentRegion(image, image, 8, 8);
  EXPECT_GE(region.x, 22);
  EXPECT_LE(region.x, 25);
  EXPECT_GE(region.y, 7);
  EXPECT_LE(region.y, 10);
  const Image flat = Filled(9, 9, 3, 0.2f);
  EXPECT_EQ(MostDifferentRegion(flat, flat, 3, 3).x, 0);
}

TEST(SideBySide, ShowsOriginalPixelsInTheEnlargedPart) {
  const Image truth = NoiseImage(100, 80, 2);
  const Image black = Filled(100, 80, 3, 0);
  const LabelledImage images[] = {{"before", "", &black}, {"truth", "", &truth}};
  const ViewRegion region{30, 40, 20, 10};
  const auto picture = SideBySide(images, {.region = region, .differences = false});
  ASSERT_TRUE(picture.ok());
  // 100 pixels become a column of 400, margin 16; the part is enlarged 20 times and ends at the lower margin.
  ASSERT_EQ(picture->width, 3 * 16 + 2 * 400);
  const int left = 2 * 16 + 400, top = picture->height - 16 - 200;
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < 200; ++y) {
      for (int x = 0; x < 400; ++x) {
        ASSERT_FLOAT_EQ(picture->at(c, top + y, left + x), truth.at(c, 40 + y / 20, 30 + x / 20)) << c << y << x;
        ASSERT_EQ(picture->at(c, top + y, 16 + x), 0.0f);
      }
    }
  }
}

TEST(CaptionText, IsWrappedBetweenWords) {
  const std::string text = "Tankard of the Mary Rose; pictures changed";
  const std::vector<std::string> lines = WrappedText(text, TextWidth("of the Mary Rose;", 2), 2);
  EXPECT_EQ(lines, (std::vector<std::string>{"Tankard of the", "Mary Rose;", "pictures changed"}));
  EXPECT_EQ(WrappedText(text, TextWidth(text, 1), 1), std::vector<std::string>{text});
  for (const std::string& line : WrappedText(std::string(300, 'w') + "  a", 100, 1)) EXPECT_LE(TextWidth(line, 1), 100);
  EXPECT_TRUE(WrappedText("", 100, 1).empty());
  EXPECT_TRUE(WrappedText("   ", 100, 1).empty());
  EXPECT_EQ(WrappedText("ab", 1, 1), (std::vector<std::string>{"a", "b"})) << "never stuck";
}

TEST(SideBySide, EndsWithTheCredit) {
  const Image truth = NoiseImage(100, 80, 2);
  const LabelledImage images[] = {{"before", "", &truth}, {"truth", "", &truth}};
  const auto without = SideBySide(images), with = SideBySide(images, {.credits = {"Mug by Ann, CC BY 4.0"}});
  ASSERT_TRUE(without.ok() && with.ok());
  ASSERT_EQ(with->width, without->width);
  ASSERT_GT(with->height, without->height + kCapitalHeight);
  int letters = 0;
  for (int y = 0; y < with->height; ++y) {
    for (int x = 0; x < with->width; ++x) {
      if (y < without->height - 4) {
        ASSERT_EQ(with->at(0, y, x), without->at(0, y, x)) << x << ' ' << y;
      } else {
        letters += with->at(0, y, x) > 0.5f;
      }
    }
  }
  EXPECT_GT(letters, 100);
}

TEST(SideBySide, MapsAreProportionalToTheGain) {
  const Image a = Filled(64, 64, 3, 0.5f), b = Filled(64, 64, 3, 0.5f);
  const LabelledImage equal[] = {{"a", "1", &a}, {"b", "2", &b}};
  const auto same = SideBySide(equal);
  ASSERT_TRUE(same.ok());
  Image c = Filled(64, 64, 3, 0.75f);
  const LabelledImage different[] = {{"a", "1", &c}, {"b", "2", &b}};
  const auto full = SideBySide(different, {.gain = 4});  // 0.25 x 4: the brightest colour
  const auto half = SideBySide(different, {.gain = 2});
  ASSERT_TRUE(full.ok() && half.ok());
  const int x = same->width / 4, y = same->height - 100;
  EXPECT_LT(same->at(0, y, x), 0.1f);
  EXPECT_NEAR(half->at(0, y, x), 0.73f, 1e-5);
  EXPECT_NEAR(full->at(1, y, x), 1.0f, 1e-5);
}

TEST(SideBySide, LargeSmallAndOddSizesWork) {
  for (const auto& [width, height] : {std::pair(1, 1), {3, 2}, {1500, 7}, {7, 900}, {641, 479}, {1024, 768}}) {
    const Image a = NoiseImage(width, height, 3), b = NoiseImage(width, height, 4);
    const LabelledImage images[] = {{"a", "", &a}, {std::string(500, 'w'), "x", &a}, {"b", "", &b}};
    const auto picture = SideBySide(images);
    ASSERT_TRUE(picture.ok()) << width << " x " << height;
    EXPECT_LE(picture->width, 3 * 640 + 4 * 40);
    EXPECT_LE(picture->height, 3 * 960 + 300);
    EXPECT_TRUE(
        std::all_of(picture->pixels.begin(), picture->pixels.end(), [](float v) { return v >= 0 && v < 1.001f; }));
    EXPECT_TRUE(SideBySide(images, {.region = ViewRegion{0, 0, width, height}}).ok());
  }
}

TEST(SideBySide, ShowsHostileValuesClamped) {
  Image a = NoiseImage(50, 40, 5), b = a;
  a.at(0, 3, 3) = std::nanf("");
  a.at(1, 20, 20) = INFINITY;
  b.at(2, 9, 9) = -INFINITY;
  const Image grey = Filled(50, 40, 1, 0.5f), alpha = Filled(50, 40, 4, 0.5f);
  const LabelledImage images[] = {{"a", "", &a}, {"grey", "", &grey}, {"alpha", "", &alpha}, {"b", "", &b}};
  const auto picture = SideBySide(images);
  ASSERT_TRUE(picture.ok());
  EXPECT_TRUE(
      std::all_of(picture->pixels.begin(), picture->pixels.end(), [](float v) { return v >= 0 && v < 1.001f; }));
}

TEST(SideBySide, BadArgumentsAreErrors) {
  const Image a = NoiseImage(20, 10, 6), b = NoiseImage(10, 20, 7), empty;
  const LabelledImage good[] = {{"a", "", &a}};
  EXPECT_TRUE(SideBySide(good).ok());
  EXPECT_FALSE(SideBySide({}).ok());
  EXPECT_FALSE(SideBySide(std::vector<LabelledImage>{{"a", "", &a}, {"b", "", &b}}).ok());
  EXPECT_FALSE(SideBySide(std::vector<LabelledImage>{{"a", "", &a}, {"b", "", &empty}}).ok());
  EXPECT_FALSE(SideBySide(std::vector<LabelledImage>{{"a", "", nullptr}}).ok());
  for (const ViewRegion& region :
       {ViewRegion{-1, 0, 2, 2}, {0, 0, 21, 2}, {0, 9, 2, 2}, {0, 0, 0, 2}, {19, 0, 2147483647, 1}}) {
    EXPECT_FALSE(SideBySide(good, {.region = region}).ok());
  }
  EXPECT_FALSE(SideBySide(good, {.crop = 0}).ok());
  EXPECT_FALSE(SideBySide(good, {.crop = 1.5}).ok());
  EXPECT_FALSE(SideBySide(good, {.gain = 0}).ok());
  EXPECT_FALSE(SideBySide(good, {.gain = INFINITY}).ok());
}

}  // namespace
}  // namespace anchorsplat
