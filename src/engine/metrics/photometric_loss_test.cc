#include "metrics/photometric_loss.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"
#include "core/simd_targets_for_test.h"
#include "metrics/image_metrics.h"

namespace anchorsplat {
namespace {

Image RandomImage(int width, int height, uint64_t seed) {
  Image image(width, height, 3);
  Random random(seed);
  for (float& x : image.pixels) x = static_cast<float>(random.Uniform());
  return image;
}

Image Disturbed(const Image& image, double size, uint64_t seed) {
  Image out = image;
  Random random(seed);
  for (float& x : out.pixels) x = static_cast<float>(x + size * random.Normal());
  return out;
}

// As in the papers, in double, one pixel at a time with the 2-D window: slow on purpose. Wang et al. 2004, eq. 13, and
// Kerbl et al. 2023, eq. 7.
struct Reference {
  double l1 = 0, ssim = 0;
  double loss(double weight) const { return (1 - weight) * l1 + weight * (1 - ssim); }
};

// SSIM of one pixel of channel c.
double SsimAt(const Image& a, const Image& b, int c, int y, int x) {
  double ma = 0, mb = 0, maa = 0, mbb = 0, mab = 0, sum = 0;
  for (int j = -5; j <= 5; ++j) {
    for (int i = -5; i <= 5; ++i) {
      const double w = std::exp(-(i * i + j * j) / (2 * 1.5 * 1.5));
      sum += w;
      if (y + j < 0 || y + j >= a.height || x + i < 0 || x + i >= a.width) continue;
      const double p = a.at(c, y + j, x + i), q = b.at(c, y + j, x + i);
      ma += w * p;
      mb += w * q;
      maa += w * p * p;
      mbb += w * q * q;
      mab += w * p * q;
    }
  }
  ma /= sum, mb /= sum, maa /= sum, mbb /= sum, mab /= sum;
  return (2 * ma * mb + 0.0001) * (2 * (mab - ma * mb) + 0.0009) /
         ((ma * ma + mb * mb + 0.0001) * (maa - ma * ma + mbb - mb * mb + 0.0009));
}

Reference ReferenceLoss(const Image& a, const Image& b, SsimPadding padding) {
  Reference r;
  const int margin = padding == SsimPadding::kValid ? 5 : 0;
  int64_t windows = 0;
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < a.height; ++y) {
      for (int x = 0; x < a.width; ++x) {
        r.l1 += std::abs(double{a.at(c, y, x)} - b.at(c, y, x));
        if (y < margin || y >= a.height - margin || x < margin || x >= a.width - margin) continue;
        r.ssim += SsimAt(a, b, c, y, x);
        ++windows;
      }
    }
  }
  r.l1 /= 3.0 * static_cast<double>(a.plane());
  r.ssim /= static_cast<double>(windows);
  return r;
}

// ∂loss/∂a(c, y, x) as a difference quotient over the windows that see the pixel.
double ReferenceSlope(const Image& a, const Image& b, const PhotometricLossOptions& options, int c, int y, int x) {
  const int margin = options.padding == SsimPadding::kValid ? 5 : 0;
  const double windows = 3.0 * (a.width - 2 * margin) * (a.height - 2 * margin);
  const auto ssim_around = [&](const Image& image) {
    double sum = 0;
    for (int v = std::max(margin, y - 5); v <= std::min(a.height - 1 - margin, y + 5); ++v) {
      for (int u = std::max(margin, x - 5); u <= std::min(a.width - 1 - margin, x + 5); ++u) {
        sum += SsimAt(image, b, c, v, u);
      }
    }
    return sum;
  };
  Image up = a, down = a;
  up.at(c, y, x) += 1e-3f;
  down.at(c, y, x) -= 1e-3f;
  const double step = double{up.at(c, y, x)} - down.at(c, y, x);
  const double ssim = (ssim_around(up) - ssim_around(down)) / step / windows;
  const double difference = double{a.at(c, y, x)} - b.at(c, y, x);
  const double sign = difference > 0 ? 1 : difference < 0 ? -1 : 0;
  return (1 - options.ssim_weight) * sign / (3.0 * static_cast<double>(a.plane())) - options.ssim_weight * ssim;
}

struct Computed {
  PhotometricLossValue value;
  Image gradient;
  PixelBox box;
};

Computed Compute(const Image& a, const Image& b, const PhotometricLossOptions& options = {}) {
  Computed c;
  // What lies outside of the box must be read as 0, not as what is there.
  c.gradient = Image(a.width, a.height, 3);
  std::fill(c.gradient.pixels.begin(), c.gradient.pixels.end(), 1e30f);
  const auto value = PhotometricLoss(a, b, options, c.gradient, c.box);
  EXPECT_TRUE(value.ok());
  c.value = *value;
  for (int channel = 0; channel < 3; ++channel) {
    for (int y = 0; y < a.height; ++y) {
      for (int x = 0; x < a.width; ++x) {
        const bool inside = x >= c.box.x0 && x < c.box.x1 && y >= c.box.y0 && y < c.box.y1;
        if (!inside) {
          EXPECT_EQ(c.gradient.at(channel, y, x), 1e30f) << "written outside of the box";
          c.gradient.at(channel, y, x) = 0;
        }
      }
    }
  }
  return c;
}

// `step`: every step-th pixel's gradient is looked at.
void ExpectMatchesReference(const Image& a, const Image& b, const PhotometricLossOptions& options, int step) {
  const Computed c = Compute(a, b, options);
  const Reference r = ReferenceLoss(a, b, options.padding);
  EXPECT_NEAR(c.value.l1, r.l1, 1e-6 * r.l1);
  EXPECT_NEAR(c.value.ssim, r.ssim, 3e-6);
  EXPECT_NEAR(c.value.loss, r.loss(options.ssim_weight), 3e-6);
  double largest = 0;
  for (const float g : c.gradient.pixels) largest = std::max(largest, std::abs(double{g}));
  for (int64_t i = 0; i < 3 * a.plane(); i += step) {
    const int channel = static_cast<int>(i / a.plane()), y = static_cast<int>(i % a.plane()) / a.width;
    const int x = static_cast<int>(i % a.width);
    EXPECT_NEAR(c.gradient.pixels[static_cast<size_t>(i)], ReferenceSlope(a, b, options, channel, y, x), 2e-3 * largest)
        << channel << " " << y << " " << x;
  }
}

TEST(PhotometricLoss, MatchesTheReferenceAtSizesThatDivideNothing) {
  const int sizes[][2] = {{11, 11}, {17, 12}, {67, 41}, {64, 33}, {300, 13}, {13, 150}};
  uint64_t seed = 0;
  for (const auto& size : sizes) {
    for (const double noise : {0.05, 0.5}) {
      for (const SsimPadding padding : {SsimPadding::kSame, SsimPadding::kValid}) {
        const Image a = RandomImage(size[0], size[1], ++seed), b = Disturbed(a, noise, ++seed);
        SCOPED_TRACE(std::to_string(size[0]) + " x " + std::to_string(size[1]));
        ExpectMatchesReference(a, b, {.ssim_weight = 0.2, .padding = padding}, 71);
      }
    }
  }
}

TEST(PhotometricLoss, TinyPicturesHaveSsimWithPadding) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 9}, {4, 3}}) {
    const Image a = RandomImage(width, height, 7), b = Disturbed(a, 0.3, 8);
    ExpectMatchesReference(a, b, {.ssim_weight = 0.5, .padding = SsimPadding::kSame}, 1);
  }
}

TEST(PhotometricLoss, SsimIsTheMetric) {
  const Image a = RandomImage(70, 45, 9), b = Disturbed(a, 0.1, 10);
  EXPECT_NEAR(Compute(a, b, {.padding = SsimPadding::kSame}).value.ssim, *Ssim(a, b), 1e-6);
}

TEST(PhotometricLoss, WeightsOfZeroAndOne) {
  const Image a = RandomImage(40, 30, 11), b = Disturbed(a, 0.1, 12);
  ExpectMatchesReference(a, b, {.ssim_weight = 1}, 37);
  const Computed only_l1 = Compute(a, b, {.ssim_weight = 0});
  EXPECT_EQ(only_l1.value.loss, only_l1.value.l1);
  for (size_t i = 0; i < a.pixels.size(); ++i) {
    EXPECT_EQ(only_l1.gradient.pixels[i], (a.pixels[i] > b.pixels[i] ? 1.0f : -1.0f) / (3 * 40 * 30));
  }
}

TEST(PhotometricLoss, EqualPicturesAreFree) {
  const Image a = RandomImage(50, 40, 13);
  const Computed c = Compute(a, a);
  EXPECT_EQ(c.value.loss, 0);
  EXPECT_EQ(c.value.ssim, 1);
  EXPECT_TRUE(c.box.empty());
}

// The box must not change the result: on a flat background, on a pattern that both pictures share, at the borders.
TEST(PhotometricLoss, TheBoxIsExact) {
  for (const float background : {0.0f, 0.4f, 1.0f, -1.0f}) {  // −1: a pattern
    for (const auto& [left, top] : {std::pair{0, 0}, {30, 21}, {57, 37}, {3, 36}, {26, 2}}) {
      Image a = RandomImage(71, 53, 14);
      if (background >= 0) std::fill(a.pixels.begin(), a.pixels.end(), background);
      Image b = a;
      Random random(15);
      for (int c = 0; c < 3; ++c) {
        for (int y = top; y < std::min(53, top + 16); ++y) {
          for (int x = left; x < std::min(71, left + 14); ++x) {
            a.at(c, y, x) = static_cast<float>(random.Uniform());
            b.at(c, y, x) = static_cast<float>(random.Uniform());
          }
        }
      }
      for (const SsimPadding padding : {SsimPadding::kSame, SsimPadding::kValid}) {
        const PhotometricLossOptions options = {.padding = padding};
        SCOPED_TRACE(std::to_string(left) + " " + std::to_string(background));
        ExpectMatchesReference(a, b, options, 113);
        const PixelBox box = Compute(a, b, options).box;
        EXPECT_EQ(box, (PixelBox{std::max(0, left - 10), std::max(0, top - 10), std::min(71, left + 24),
                                 std::min(53, top + 26)}));
      }
    }
  }
}

TEST(PhotometricLoss, OneDifferentPixelIsSeen) {
  for (const auto& [x, y] : {std::pair{0, 0}, {39, 29}, {17, 3}}) {
    Image a(40, 30, 3);
    std::fill(a.pixels.begin(), a.pixels.end(), 0.5f);
    const Image b = a;
    a.at(1, y, x) = 0.8f;
    ExpectMatchesReference(a, b, {}, 1);
  }
}

// Two flat pictures that nearly agree: where a variance as a difference of means loses its digits.
TEST(PhotometricLoss, FlatBrightPicturesKeepTheirDigits) {
  Image a(40, 30, 3);
  std::fill(a.pixels.begin(), a.pixels.end(), 0.9f);
  const Image b = Disturbed(a, 0.003, 16);
  ExpectMatchesReference(a, b, {}, 17);
}

TEST(PhotometricLoss, IsTheSameForAnyNumberOfThreads) {
  const Image a = RandomImage(301, 203, 17), b = Disturbed(a, 0.1, 18);
  SetThreadCount(1);
  const Computed one = Compute(a, b);
  for (const int threads : {2, 5}) {
    SetThreadCount(threads);
    const Computed many = Compute(a, b);
    EXPECT_EQ(many.value.loss, one.value.loss);
    EXPECT_EQ(many.gradient.pixels, one.gradient.pixels);
  }
  SetThreadCount(0);
}

TEST(PhotometricLoss, EveryInstructionSetMatches) {
  const Image a = RandomImage(67, 41, 19), b = Disturbed(a, 0.2, 20);
  ForEachSimdTarget([&] { ExpectMatchesReference(a, b, {}, 97); });
  SkipWhenOnlyOneSimdTarget();
}

TEST(PhotometricLoss, NotANumberIsNotHidden) {
  const Image a = RandomImage(30, 30, 21);
  Image b = a;
  b.at(1, 15, 15) = std::nanf("");
  const Computed c = Compute(a, b);
  EXPECT_TRUE(std::isnan(c.value.loss));
  EXPECT_FALSE(c.box.empty());
}

TEST(PhotometricLoss, RefusesWhatCannotBeCompared) {
  const Image a = RandomImage(30, 20, 22);
  Image gradient;
  PixelBox box;
  const auto message = [&](const Image& b, const PhotometricLossOptions& options) {
    const auto value = PhotometricLoss(a, b, options, gradient, box);
    return value.ok() ? std::string() : value.error().message;
  };
  EXPECT_NE(message(RandomImage(20, 30, 23), {}).find("30 x 20 x 3 and 20 x 30 x 3"), std::string::npos);
  EXPECT_NE(message(Image(30, 20, 4), {}).find("30 x 20 x 4"), std::string::npos);
  EXPECT_NE(message(a, {.ssim_weight = 1.5}).find("1.5"), std::string::npos);
  EXPECT_NE(message(a, {.ssim_weight = std::nan("")}), "");
  EXPECT_FALSE(PhotometricLoss(Image(), Image(), {}, gradient, box).ok());
  const Image small = RandomImage(10, 40, 24);
  EXPECT_FALSE(PhotometricLoss(small, small, {.padding = SsimPadding::kValid}, gradient, box).ok());
  EXPECT_TRUE(PhotometricLoss(small, small, {.padding = SsimPadding::kSame}, gradient, box).ok());
}

}  // namespace
}  // namespace anchorsplat
