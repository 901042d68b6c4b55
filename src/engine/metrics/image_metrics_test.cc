#include "metrics/image_metrics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"
#include "images/image_io.h"

namespace anchorsplat {
namespace {

Image RandomImage(int width, int height, int channels, uint64_t seed) {
  Image image(width, height, channels);
  Random random(seed);
  for (float& x : image.pixels) x = static_cast<float>(random.Uniform());
  return image;
}

// The same picture with a disturbance of the given size.
Image Disturbed(const Image& image, double size, uint64_t seed) {
  Image out = image;
  Random random(seed);
  for (float& x : out.pixels) x = static_cast<float>(x + size * random.Normal());
  return out;
}

// As in Wang et al. 2004, eq. 13, one pixel at a time with the 2-D window: slow on purpose.
double SsimReference(const Image& a, const Image& b) {
  double window[11][11], sum = 0;
  for (int j = 0; j < 11; ++j) {
    for (int i = 0; i < 11; ++i) {
      sum += window[j][i] = std::exp(-((i - 5.0) * (i - 5.0) + (j - 5.0) * (j - 5.0)) / (2 * 1.5 * 1.5));
    }
  }
  const int channels = std::min(a.channels, 3);
  double total = 0;
  for (int c = 0; c < channels; ++c) {
    for (int y = 0; y < a.height; ++y) {
      for (int x = 0; x < a.width; ++x) {
        double ma = 0, mb = 0, maa = 0, mbb = 0, mab = 0;
        for (int j = 0; j < 11; ++j) {
          for (int i = 0; i < 11; ++i) {
            const int v = y + j - 5, u = x + i - 5;
            if (v < 0 || v >= a.height || u < 0 || u >= a.width) continue;
            const double w = window[j][i] / sum, p = a.at(c, v, u), q = b.at(c, v, u);
            ma += w * p;
            mb += w * q;
            maa += w * p * p;
            mbb += w * q * q;
            mab += w * p * q;
          }
        }
        total += (2 * ma * mb + 0.0001) * (2 * (mab - ma * mb) + 0.0009) /
                 ((ma * ma + mb * mb + 0.0001) * (maa - ma * ma + mbb - mb * mb + 0.0009));
      }
    }
  }
  return total / static_cast<double>(a.plane() * channels);
}

double PsnrReference(const Image& a, const Image& b) {
  double sum = 0;
  const int64_t count = a.plane() * std::min(a.channels, 3);
  for (int64_t i = 0; i < count; ++i) {
    const double difference = static_cast<double>(a.pixels[static_cast<size_t>(i)]) - b.pixels[static_cast<size_t>(i)];
    sum += difference * difference;
  }
  return -10 * std::log10(sum / static_cast<double>(count));
}

TEST(ImageMetrics, MatchTheReferenceAtSizesThatDivideNothing) {
  const int sizes[][2] = {{1, 1}, {1, 40}, {3, 2}, {11, 11}, {17, 5}, {67, 41}, {64, 33}, {129, 70}};
  uint64_t seed = 0;
  for (const auto& size : sizes) {
    for (const double noise : {1e-3, 0.05, 0.5}) {
      const Image a = RandomImage(size[0], size[1], 3, ++seed), b = Disturbed(a, noise, ++seed);
      const auto ssim = Ssim(a, b), psnr = Psnr(a, b);
      ASSERT_TRUE(ssim.ok() && psnr.ok());
      EXPECT_NEAR(*ssim, SsimReference(a, b), 2e-6) << size[0] << " x " << size[1] << " noise " << noise;
      EXPECT_NEAR(*psnr, PsnrReference(a, b), 1e-5) << size[0] << " x " << size[1] << " noise " << noise;
    }
  }
}

// Bright flat areas are where a variance as a difference of float means loses its digits.
TEST(ImageMetrics, MatchTheReferenceOnFlatPictures) {
  for (const float level : {0.0f, 0.3f, 1.0f}) {
    Image a(50, 40, 3);
    std::fill(a.pixels.begin(), a.pixels.end(), level);
    const Image b = Disturbed(a, 0.01, 3);
    EXPECT_NEAR(*Ssim(a, b), SsimReference(a, b), 1e-4) << level;
    EXPECT_NEAR(*Psnr(a, b), PsnrReference(a, b), 1e-4) << level;
  }
}

TEST(ImageMetrics, OfEqualPicturesArePerfect) {
  for (uint64_t seed : {1, 2, 3}) {
    const Image a = RandomImage(53, 47, 3, seed);
    EXPECT_EQ(*Psnr(a, a), std::numeric_limits<double>::infinity());
    EXPECT_EQ(*Ssim(a, a), 1.0);
  }
}

TEST(ImageMetrics, IgnoreAlphaAndTakeOneChannel) {
  const Image a = RandomImage(20, 20, 4, 5);
  Image b = Disturbed(a, 0.1, 6);
  const double ssim = *Ssim(a, b), psnr = *Psnr(a, b);
  std::fill(b.channel(3), b.channel(3) + b.plane(), 0.5f);
  EXPECT_EQ(*Ssim(a, b), ssim);
  EXPECT_EQ(*Psnr(a, b), psnr);
  const Image grey = RandomImage(20, 20, 1, 7), other = Disturbed(grey, 0.1, 8);
  EXPECT_NEAR(*Ssim(grey, other), SsimReference(grey, other), 2e-6);
}

TEST(ImageMetrics, AreSymmetric) {
  const Image a = RandomImage(40, 30, 3, 9), b = RandomImage(40, 30, 3, 10);
  EXPECT_EQ(*Psnr(a, b), *Psnr(b, a));
  EXPECT_NEAR(*Ssim(a, b), *Ssim(b, a), 1e-7);
}

TEST(ImageMetrics, AreTheSameForAnyNumberOfThreads) {
  const Image a = RandomImage(301, 203, 3, 11), b = Disturbed(a, 0.1, 12);
  const int before = ThreadCount();
  SetThreadCount(1);
  const double ssim = *Ssim(a, b), psnr = *Psnr(a, b);
  for (const int threads : {2, 3, 8}) {
    SetThreadCount(threads);
    EXPECT_EQ(*Ssim(a, b), ssim) << threads;
    EXPECT_EQ(*Psnr(a, b), psnr) << threads;
  }
  SetThreadCount(before);
}

TEST(ImageMetrics, NotANumberIsNotHidden) {
  const Image a = RandomImage(30, 30, 3, 13);
  Image b = a;
  b.at(1, 15, 15) = std::nanf("");
  EXPECT_TRUE(std::isnan(*Psnr(a, b)));
  EXPECT_TRUE(std::isnan(*Ssim(a, b)));
}

TEST(ImageMetrics, DifferentSizesAreAnError) {
  const Image a = RandomImage(30, 20, 3, 14);
  for (const Image& b : {RandomImage(20, 30, 3, 15), RandomImage(30, 20, 4, 16), Image()}) {
    EXPECT_FALSE(Psnr(a, b).ok());
    EXPECT_FALSE(Ssim(a, b).ok());
  }
  EXPECT_FALSE(Psnr(Image(), Image()).ok());
  EXPECT_NE(Ssim(a, RandomImage(20, 30, 3, 17)).error().message.find("30 x 20 x 3 and 20 x 30 x 3"), std::string::npos);
}

TEST(ImageMetrics, ClampKeepsWhatIsInside) {
  Image image(4, 1, 1);
  image.pixels = {-0.5f, 0.25f, 1.0f, 7.0f};
  Clamp01(image);
  EXPECT_EQ(image.pixels, (Buffer<float>{0.0f, 0.25f, 1.0f, 1.0f}));
}

// Means over what counts alone: by the reference, of pictures that are the same where nothing does.
TEST(ImageMetrics, MaskedAreMeansOverWhatCounts) {
  const Image a = RandomImage(37, 29, 3, 21);
  Image b = Disturbed(a, 0.2, 22);
  std::vector<uint8_t> ignored(static_cast<size_t>(a.plane()));
  double squares = 0;
  int64_t counted = 0;
  for (size_t i = 0; i < ignored.size(); ++i) {
    ignored[i] = i % 37 < 20 || i % 5 == 0;
    counted += ignored[i] == 0;
    for (int c = 0; c < 3; ++c) {
      if (ignored[i] != 0) b.channel(c)[i] = a.channel(c)[i];
      squares += std::pow(a.channel(c)[i] - b.channel(c)[i], 2);
    }
  }
  const auto masked = MeasureMasked(a, b, ignored);
  ASSERT_TRUE(masked.ok());
  EXPECT_EQ(masked->counted, counted);
  EXPECT_NEAR(masked->psnr, -10 * std::log10(squares / static_cast<double>(3 * counted)), 1e-4);
  EXPECT_GE(masked->ssim, -1);
  EXPECT_LT(masked->ssim, *Ssim(a, b)) << "what is the same no longer counts";
  // One pixel: the mean over it is its own value, never below -1, where 1 - (1 - SSIM) / share would be.
  std::fill(ignored.begin(), ignored.end(), uint8_t{1});
  ignored[500] = 0;
  Image one = a;
  for (int c = 0; c < 3; ++c) one.channel(c)[500] = 1 - a.channel(c)[500];
  const auto single = MeasureMasked(a, one, ignored);
  ASSERT_TRUE(single.ok());
  EXPECT_EQ(single->counted, 1);
  EXPECT_GE(single->ssim, -1);
  EXPECT_LE(single->ssim, 1);

  const auto all = MeasureMasked(a, b, {});
  EXPECT_EQ(all->psnr, *Psnr(a, b));
  EXPECT_EQ(all->ssim, *Ssim(a, b));
  std::fill(ignored.begin(), ignored.end(), uint8_t{1});
  EXPECT_EQ(MeasureMasked(a, a, ignored)->counted, 0);
  EXPECT_FALSE(MeasureMasked(a, b, std::span(ignored).first(7)).ok());
}

}  // namespace
}  // namespace anchorsplat
