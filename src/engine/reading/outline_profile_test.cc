#include "reading/outline_profile.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/random.h"

namespace anchorsplat {
namespace {

constexpr size_t kQuantiles = kOutlineQuantiles.size();
constexpr size_t kFirstBand = kOutlineLevels.size() * kQuantiles;

// alpha(x, y) at pixel centres.
template <typename Alpha>
Image Picture(int width, int height, Alpha&& alpha) {
  Image image(width, height, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.at(0, y, x) = static_cast<float>(alpha(x + 0.5, y + 0.5));
  }
  return image;
}

// A straight outline across the middle, rising linearly over `width` pixels along (cos, sin) of `angle`.
Image Edge(double width, double angle) {
  return Picture(256, 256, [&](double x, double y) {
    const double across = (x - 128) * std::cos(angle) + (y - 128) * std::sin(angle);
    return std::clamp(across / width + 0.5, 0.0, 1.0);
  });
}

TEST(OutlineProfile, KnowsTheWidthOfAStraightOutline) {
  for (const double width : {24.0, 40.0}) {
    for (const double angle : {0.0, 0.4, 0.785398, 1.570796, 2.5}) {
      OutlineProfile profile;
      profile.Add(Edge(width, angle), 0.25);
      const auto values = profile.Values();
      for (size_t k = 0; k < kFirstBand; ++k) {
        EXPECT_NEAR(values[k], std::log(0.25 * width), 0.06) << width << " " << angle << " " << k;
      }
    }
    // Bands count area over what the lattice crosses, which is the length for outlines along it.
    OutlineProfile profile;
    profile.Add(Edge(width, 0), 0.25);
    double area = 0;
    const auto values = profile.Values();
    for (size_t b = 0; b + 1 < kOutlineBands.size(); ++b) {
      area += std::exp(values[kFirstBand + b]) * double{kOutlineBands[b + 1] - kOutlineBands[b]};
    }
    EXPECT_NEAR(area, 0.25 * width * double{kOutlineBands.back() - kOutlineBands.front()}, 0.3) << width;
  }
}

TEST(OutlineProfile, LengthsScaleAndPicturesAdd) {
  OutlineProfile once, twice, large;
  once.Add(Edge(20, 0.3), 0.25);
  twice.Add(Edge(20, 0.3), 0.25);
  twice.Add(Edge(20, 0.3), 0.25);
  large.Add(Edge(20, 0.3), 0.5);
  for (size_t k = 0; k < kOutlineValues; ++k) {
    EXPECT_NEAR(once.Values()[k], twice.Values()[k], 0.01) << k;
    EXPECT_NEAR(once.Values()[k] + std::log(2.0), large.Values()[k], 0.06) << k;
  }
}

// A sharp and a soft outline: without the soft one, what is left are the sharp one's widths.
TEST(OutlineProfile, WhatWasCutIsLeftOut) {
  const Image both = Picture(256, 256, [](double x, double) {
    return x < 128 ? std::clamp((x - 60) / 16 + 0.5, 0.0, 1.0) : std::clamp((190 - x) / 48 + 0.5, 0.0, 1.0);
  });
  std::vector<float> cut(256 * 256);
  for (size_t k = 0; k < cut.size(); ++k) cut[k] = k % 256 > 128 ? 0.5f * both.pixels[k] : 0.1f * both.pixels[k];
  OutlineProfile whole, sharp;
  whole.Add(both, 1);
  sharp.Add(both, 1, cut.data());
  EXPECT_EQ(whole.Cut(), 0);
  EXPECT_NEAR(sharp.Cut(), 0.5, 0.01);
  const auto values = sharp.Values();
  for (size_t k = 0; k < kFirstBand; ++k) EXPECT_NEAR(values[k], std::log(16.0), 0.06) << k;
  double area = 0;
  for (size_t b = 0; b + 1 < kOutlineBands.size(); ++b) {
    area += std::exp(values[kFirstBand + b]) * double{kOutlineBands[b + 1] - kOutlineBands[b]};
  }
  EXPECT_NEAR(area, 16, 1);
  EXPECT_EQ(OutlineProfile().Cut(), 0);
  // Coarse ones likewise; what both have counts as cut.
  OutlineProfile coarse, all;
  coarse.Add(both, 1, nullptr, cut.data());
  EXPECT_EQ(coarse.Cut(), 0);
  EXPECT_NEAR(coarse.Coarse(), 0.5, 0.01);
  EXPECT_EQ(coarse.Values(), values);
  all.Add(both, 1, cut.data(), cut.data());
  EXPECT_NEAR(all.Cut(), 0.5, 0.01);
  EXPECT_LT(all.Coarse(), 0.5);
}

// The same from the definition, without histograms.
std::array<double, kOutlineValues> Reference(const Image& alpha, double pixel) {
  const auto at = [&](int x, int y) { return double{alpha.at(0, y, x)}; };
  std::array<double, kOutlineValues> out{};
  double crossings = 0;
  for (size_t level = 0; level < kOutlineLevels.size(); ++level) {
    const double value = double{kOutlineLevels[level]};
    std::vector<std::pair<double, double>> widths;
    double total = 0;
    for (int y = 1; y + 2 < alpha.height; ++y) {
      for (int x = 1; x + 2 < alpha.width; ++x) {
        for (const auto& [dx, dy] : {std::pair(1, 0), std::pair(0, 1)}) {
          const double begin = at(x, y), end = at(x + dx, y + dy);
          if ((begin < value) == (end < value)) continue;
          if (value == 0.5) ++crossings;
          const double t = (value - begin) / (end - begin);
          const auto gradient = [&](int u, int v) {  // along (u, v), at the crossing
            const double here = at(x + u, y + v) - at(x - u, y - v);
            const double next = at(x + dx + u, y + dy + v) - at(x + dx - u, y + dy - v);
            return 0.5 * ((1 - t) * here + t * next);
          };
          const double along = gradient(dx, dy), size = std::hypot(along, gradient(dy, dx));
          widths.emplace_back(std::log(pixel / size), std::fabs(along) / size);
          total += widths.back().second;
        }
      }
    }
    std::sort(widths.begin(), widths.end());
    for (size_t q = 0; q < kQuantiles; ++q) {
      double sum = 0;
      size_t k = 0;
      while (k + 1 < widths.size() && sum + widths[k].second < kOutlineQuantiles[q] * total) sum += widths[k++].second;
      out[level * kQuantiles + q] = widths.empty() ? 0 : widths[k].first;
    }
  }
  for (size_t b = 0; b + 1 < kOutlineBands.size(); ++b) {
    const auto inside = std::count_if(alpha.pixels.begin(), alpha.pixels.end(),
                                      [&](float a) { return a >= kOutlineBands[b] && a < kOutlineBands[b + 1]; });
    out[kFirstBand + b] = std::log((static_cast<double>(inside) + 1) * pixel /
                                   ((crossings + 1) * double{kOutlineBands[b + 1] - kOutlineBands[b]}));
  }
  return out;
}

TEST(OutlineProfile, MatchesTheReferenceOnRandomBlobs) {
  for (uint64_t seed = 0; seed < 10; ++seed) {
    Random random(seed);
    struct Blob {
      double x, y, size, opacity;
    };
    std::vector<Blob> blobs(40);
    for (Blob& b : blobs) {
      b = {random.Uniform() * 90, random.Uniform() * 70, 3 + 6 * random.Uniform(), 0.5 + 0.49 * random.Uniform()};
    }
    const Image picture = Picture(90, 70, [&](double x, double y) {
      double through = 1;
      for (const Blob& b : blobs) {
        through *= 1 - b.opacity * std::exp(-0.5 * ((x - b.x) * (x - b.x) + (y - b.y) * (y - b.y)) / (b.size * b.size));
      }
      return 1 - through;
    });
    OutlineProfile profile;
    profile.Add(picture, 0.4);
    const auto values = profile.Values(), expected = Reference(picture, 0.4);
    for (size_t k = 0; k < kOutlineValues; ++k) EXPECT_NEAR(values[k], expected[k], 0.11) << seed << " " << k;
  }
}

// Stretches of a row that are empty or opaque are passed over; outlines begin and end anywhere in them.
TEST(OutlineProfile, MatchesTheReferenceBetweenPlateaus) {
  for (uint64_t seed = 0; seed < 10; ++seed) {
    Random random(seed);
    const double x0 = 20 + 60 * random.Uniform(), y0 = 20 + 60 * random.Uniform(), radius = 8 + 20 * random.Uniform();
    const double soft = 1 + 2 * random.Uniform();
    const Image picture = Picture(117, 101, [&](double x, double y) {
      return std::clamp((radius - std::hypot(x - x0, y - y0)) / soft + 0.5, 0.0, 1.0);
    });
    OutlineProfile profile;
    profile.Add(picture, 0.4);
    const auto values = profile.Values(), expected = Reference(picture, 0.4);
    for (size_t k = 0; k < kFirstBand; ++k) EXPECT_NEAR(values[k], expected[k], 0.11) << seed << " " << k;
    for (size_t k = kFirstBand; k < kOutlineValues; ++k) EXPECT_NEAR(values[k], expected[k], 1e-9) << seed << " " << k;
  }
}

TEST(OutlineProfile, PicturesWithoutOutlines) {
  for (const double alpha : {0.0, 0.5, 1.0}) {
    for (const int size : {1, 2, 3, 33}) {
      OutlineProfile profile;
      profile.Add(Picture(size, size, [&](double, double) { return alpha; }), 0.5);
      const auto values = profile.Values();
      for (size_t k = 0; k < kFirstBand; ++k) EXPECT_EQ(values[k], 0);
      for (const double value : values) EXPECT_TRUE(std::isfinite(value));
    }
  }
  for (const double value : OutlineProfile().Values()) EXPECT_TRUE(std::isfinite(value));
}

}  // namespace
}  // namespace anchorsplat
