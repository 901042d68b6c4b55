#include "dataset/picture_defects.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "images/image_io.h"

namespace anchorsplat {
namespace {

constexpr std::array<float, 3> kWhite = {1, 1, 1};

// A disc of colour on nothing.
Image Disc(int size) {
  Image image(size, size, 4);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const double r = std::hypot(x + 0.5 - size / 2.0, y + 0.5 - size / 2.0);
      image.at(0, y, x) = 0.5f;
      image.at(1, y, x) = 0.3f + 0.2f * static_cast<float>(x % 2);
      image.at(2, y, x) = 0.2f;
      image.at(3, y, x) = r < size / 4.0 ? 1.0f : 0.0f;
    }
  }
  return image;
}

Image Photo(const PictureDefects& defects, const char* name = "003", uint64_t seed = 5) {
  auto photo = WithDefects(Disc(40), defects, kWhite, name, seed);
  EXPECT_TRUE(photo.ok()) << photo.error().message;
  return *std::move(photo);
}

int64_t PixelsOff(const Image& photo) {
  int64_t count = 0;
  for (int64_t i = 0; i < photo.plane(); ++i) count += photo.channel(2)[i] != 1 ? 1 : 0;
  return count;
}

TEST(PictureDefects, NoneIsThePictureOverItsBackground) {
  const Image photo = Photo({}), truth = CompositeOver(Disc(40), kWhite);
  EXPECT_EQ(photo.channels, 3);
  for (size_t i = 0; i < photo.pixels.size(); ++i) EXPECT_EQ(photo.pixels[i], truth.pixels[i]);
}

TEST(PictureDefects, NameAndSeedDecide) {
  const auto same = [](const Image& a, const Image& b) {
    return std::equal(a.pixels.begin(), a.pixels.end(), b.pixels.begin());
  };
  const PictureDefects poor{.noise = 5, .jpeg = 70, .exposure = 0.1, .mask = 1, .defocus = 0.5};
  EXPECT_TRUE(same(Photo(poor), Photo(poor)));
  EXPECT_FALSE(same(Photo(poor), Photo(poor, "004")));
  EXPECT_FALSE(same(Photo(poor), Photo(poor, "003", 6)));
}

TEST(PictureDefects, NoiseAndExposureAreAsLargeAsTheySay) {
  const Image truth = Photo({}), noisy = Photo({.noise = 10}), exposed = Photo({.exposure = 0.2});
  double variance = 0;
  int64_t inside = 0;
  for (int64_t i = 0; i < truth.plane(); ++i) {
    const bool object = truth.channel(2)[i] != 1;
    for (int c = 0; c < 3; ++c) {
      const double off = static_cast<double>(noisy.channel(c)[i]) - static_cast<double>(truth.channel(c)[i]);
      if (object) {
        variance += off * off;
      } else {
        EXPECT_EQ(off, 0);  // outside of the mask
      }
    }
    inside += object ? 3 : 0;
    const float factor = exposed.channel(0)[i] / truth.channel(0)[i];
    EXPECT_NEAR(factor, object ? exposed.at(0, 20, 20) / truth.at(0, 20, 20) : 1.0f, 1e-5);
    EXPECT_LE(std::abs(factor - 1), 0.2001);
  }
  EXPECT_NEAR(255 * std::sqrt(variance / static_cast<double>(inside)), 10, 0.7);
}

TEST(PictureDefects, MasksCutAlongTheOutlineAndBlurReachesBeyondIt) {
  const int64_t whole = PixelsOff(Photo({}));
  const int64_t cut = PixelsOff(Photo({.mask = 1})), more = PixelsOff(Photo({.mask = 2}));
  // A disc of radius 10 becomes one of 9 and 8.
  EXPECT_NEAR(static_cast<double>(whole - cut), std::numbers::pi * (100 - 81), 16);
  EXPECT_NEAR(static_cast<double>(whole - more), std::numbers::pi * (100 - 64), 16);
  EXPECT_GT(PixelsOff(Photo({.defocus = 1})), whole + 30);
}

TEST(PictureDefects, AimIsOffByThatManyPixelsAndThePlaceStays) {
  Camera camera = OrbitCameras(5, 1.7, {0, 0, 0}, PinholeFromFov(64, 64, 0.8))->cameras[3];
  const Camera off = WithWrongAim(camera, {.pose = 0.3}, 9), other = WithWrongAim(camera, {.pose = 0.3}, 10);
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(off.Center()[k], camera.Center()[k], 1e-12);
  const auto seen = off.ToCamera({0, 0, 0});
  const double x = camera.intrinsics.fx * seen[0] / seen[2], y = camera.intrinsics.fy * seen[1] / seen[2];
  EXPECT_NEAR(std::hypot(x, y), 0.3, 1e-9);
  EXPECT_NE(off.world_to_camera.rotation, other.world_to_camera.rotation);
  EXPECT_EQ(WithWrongAim(camera, {}, 9).world_to_camera.rotation, camera.world_to_camera.rotation);
}

TEST(PictureDefects, WhatIsAbsurdIsRefused) {
  EXPECT_TRUE(Validate(PictureDefects{}).ok());
  for (const PictureDefects& defects :
       {PictureDefects{.noise = -1}, PictureDefects{.jpeg = 101}, PictureDefects{.exposure = 2},
        PictureDefects{.pose = std::nan("")}, PictureDefects{.mask = 1000}, PictureDefects{.defocus = -0.5}}) {
    EXPECT_EQ(Validate(defects).error().code, ErrorCode::kBadArgument);
  }
}

}  // namespace
}  // namespace anchorsplat
