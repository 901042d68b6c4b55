#include "fit/pixel_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "core/parallel.h"
#include "core/random.h"

namespace anchorsplat {
namespace {

Image RandomImage(int width, int height, uint64_t seed) {
  Image image(width, height, 3);
  Random random(seed);
  for (float& x : image.pixels) x = static_cast<float>(random.Uniform());
  return image;
}

double Dot(const Image& a, const Image& b) {
  double sum = 0;
  for (size_t i = 0; i < a.pixels.size(); ++i) sum += double{a.pixels[i]} * b.pixels[i];
  return sum;
}

TEST(AverageRays, IsTheMeanOfEveryBlock) {
  for (const int samples : {1, 2, 3, 4, 7}) {
    const int width = 19, height = 23;
    const Image rays = RandomImage(width * samples, height * samples, static_cast<uint64_t>(samples));
    Image averages;
    AverageRays(rays, samples, averages);
    ASSERT_EQ(averages.width, width);
    ASSERT_EQ(averages.height, height);
    for (int c = 0; c < 3; ++c) {
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          double sum = 0;
          for (int j = 0; j < samples; ++j) {
            for (int i = 0; i < samples; ++i) sum += rays.at(c, y * samples + j, x * samples + i);
          }
          EXPECT_NEAR(averages.at(c, y, x), sum / (samples * samples), 1e-6) << samples;
        }
      }
    }
  }
}

TEST(SpreadToRays, IsTheTransposeOfTheMean) {
  for (const int samples : {1, 2, 3, 4}) {
    const Image rays = RandomImage(20 * samples, 17 * samples, 1), weights = RandomImage(20, 17, 2);
    Image averages, spread;
    AverageRays(rays, samples, averages);
    const PixelBox box = SpreadToRays(weights, {0, 0, 20, 17}, samples, spread);
    EXPECT_EQ(box, (PixelBox{0, 0, 20 * samples, 17 * samples}));
    EXPECT_NEAR(Dot(averages, weights), Dot(rays, spread), 1e-4);
  }
}

TEST(SpreadToRays, StaysWithinItsBox) {
  const Image weights = RandomImage(20, 17, 3);
  Image spread(40, 34, 3);
  std::fill(spread.pixels.begin(), spread.pixels.end(), -5.0f);
  const PixelBox box = SpreadToRays(weights, {3, 5, 9, 16}, 2, spread);
  EXPECT_EQ(box, (PixelBox{6, 10, 18, 32}));
  for (int y = 0; y < 34; ++y) {
    for (int x = 0; x < 40; ++x) {
      const bool inside = x >= 6 && x < 18 && y >= 10 && y < 32;
      EXPECT_EQ(spread.at(1, y, x), inside ? weights.at(1, y / 2, x / 2) / 4 : -5.0f) << x << ", " << y;
    }
  }
  EXPECT_TRUE(SpreadToRays(weights, {}, 2, spread).empty());
}

TEST(PixelModel, AllRaysAreTheCloserViewItself) {
  const RenderOptions options;
  const RenderOptions rays = RaysOf(AreaModel(4), options);
  EXPECT_EQ(DilationOf(rays), kDilation);
  EXPECT_EQ(rays.mode, RenderMode::kClassic);
  EXPECT_EQ(AreaModel(4).samples, 4);
  EXPECT_EQ(AreaModel(2.5).samples, 3);
  EXPECT_EQ(DilationOf(RaysOf(AreaModel(2.5), options)), kDilation);
  EXPECT_EQ(DilationOf(RaysOf(AreaModel(4), RenderOptions{.mode = RenderMode::kMip})), kMipDilation);
  EXPECT_TRUE(AreaModel(1).IsPoint());
  EXPECT_EQ(RaysOf(PixelModel{}, options).mode, RenderMode::kClassic);
}

// Dilation and block together have the same variance, in pixels of the picture, for any number of rays.
TEST(PixelModel, FewerRaysHaveTheSameWidth) {
  for (const double upscale : {2.0, 3.0, 4.0, 8.0}) {
    const double expected = 0.3 / (upscale * upscale) + (1 - 1 / (upscale * upscale)) / 12;
    for (int samples = 1; samples <= upscale; ++samples) {
      const double square = samples * samples;
      const double dilation = DilationOf(RaysOf(PixelModel{samples, upscale}, RenderOptions{}));
      EXPECT_NEAR(dilation / square + (1 - 1 / square) / 12, expected, 1e-7) << upscale << ", " << samples;
    }
  }
}

GaussianCloud OneGaussian() {
  GaussianCloud cloud;
  cloud.Resize(1, 0);
  cloud.means = {0.003f, -0.002f, 0};
  cloud.log_scales = {std::log(0.006f), std::log(0.02f), std::log(0.01f)};
  cloud.quats = {0.9f, 0.1f, -0.3f, 0.2f};
  cloud.opacity_logits = {0.2f};
  cloud.sh = {0.5f, 0.1f, -0.4f};
  return cloud;
}

Camera CameraAt2() {
  Camera camera;
  camera.intrinsics = {32, 32, 200, 200, 16, 16};
  camera.world_to_camera = LookAt({0, 0, -2}, {0, 0, 0}, {0, 1, 0}).value();
  return camera;
}

TEST(PixelModel, OneGaussianKeepsItsIntegral) {
  RenderOptions options;
  options.min_alpha = 1e-6f;
  std::array<double, 4> sums{};
  for (const RenderMode mode : kRenderModes) {
    options.mode = mode;
    for (int samples = 1; samples <= 4; ++samples) {
      const PixelModel model{samples, 4};
      Rasterizer rasterizer;
      RenderOutput output;
      Image average;
      ASSERT_TRUE(rasterizer.Render(OneGaussian(), RaysOf(model, CameraAt2()), RaysOf(model, options), output).ok());
      AverageRays(output.color, samples, average);
      sums[static_cast<size_t>(samples - 1)] = std::accumulate(average.pixels.begin(), average.pixels.end(), 0.0);
    }
    for (const double sum : sums) EXPECT_NEAR(sum, sums[3], 0.01 * sums[3]) << static_cast<int>(mode);
  }
}

TEST(PixelModel, RefusesWhatCannotBe) {
  EXPECT_TRUE(Validate(PixelModel{3, 2.5}).ok());
  EXPECT_FALSE(Validate(PixelModel{4, 2.5}).ok());
  EXPECT_FALSE(Validate(PixelModel{0, 4}).ok());
  EXPECT_FALSE(Validate(PixelModel{1, 0.5}).ok());
  EXPECT_FALSE(Validate(PixelModel{1, std::nan("")}).ok());
  EXPECT_FALSE(Validate(PixelModel{1, kMostSamples + 1.0}).ok());
}

TEST(PixelSchedule, GoesFromOneRayToAll) {
  const PixelSchedule schedule{4, 0.5, 0.75};
  EXPECT_EQ(PixelModelAt(schedule, 0), (PixelModel{1, 4}));
  EXPECT_EQ(PixelModelAt(schedule, 0.49), (PixelModel{1, 4}));
  EXPECT_EQ(PixelModelAt(schedule, 0.5), (PixelModel{2, 4}));
  EXPECT_EQ(PixelModelAt(schedule, 0.75), (PixelModel{4, 4}));
  EXPECT_EQ(PixelModelAt(schedule, 1), (PixelModel{4, 4}));
  EXPECT_TRUE(PixelModelAt(PixelSchedule{}, 1).IsPoint());
  EXPECT_TRUE(Validate(schedule).ok());
  EXPECT_FALSE(Validate(PixelSchedule{4, 0.8, 0.7}).ok());
  EXPECT_FALSE(Validate(PixelSchedule{0, 0.5, 0.7}).ok());
}

}  // namespace
}  // namespace anchorsplat
