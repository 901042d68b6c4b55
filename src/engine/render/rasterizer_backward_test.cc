#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "core/parallel.h"
#include "core/simd_targets_for_test.h"
#include "core/spherical_harmonics.h"
#include "render/gradient_check_for_test.h"
#include "render/scenes_for_test.h"

namespace anchorsplat {
namespace {

using test::ExpectGradientMatches;
using test::FrontCamera;
using test::Gradient;
using test::LinearLoss;
using test::OneGaussian;
using test::RandomCamera;
using test::RandomCloud;
using test::RandomLoss;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// No cut-offs, so that every Gaussian reaches every pixel of its tiles.
RenderOptions Smooth() {
  RenderOptions options;
  options.min_alpha = 1e-9f;
  options.min_transmittance = 0;
  return options;
}

TEST(RasterizerBackward, MatchesDifferenceQuotientsWithoutCutOffs) {
  for (uint64_t seed = 0; seed < 12; ++seed) {
    RenderOptions options = Smooth();
    options.profile = seed % 2 == 0 ? RasterProfile::kGsplat14 : RasterProfile::kGsplat15;
    options.mode = kRenderModes[seed / 2 % 3];
    options.compensated_from = seed % 4 == 3 ? 0.05f : 0.0f;
    options.background = {0.3f, static_cast<float>(seed % 3) * 0.5f, 1.0f};
    const GaussianCloud cloud = RandomCloud(seed, {.gaussians = 12, .degree = static_cast<int>(seed % 4)});
    const Camera camera = RandomCamera(seed, 23, 19);
    SCOPED_TRACE(seed);
    ExpectGradientMatches(cloud, camera, options, RandomLoss(seed, cloud, camera, options));
  }
}

TEST(RasterizerBackward, MatchesDifferenceQuotientsBetweenTheCutOffs) {
  for (uint64_t seed = 20; seed < 26; ++seed) {
    RenderOptions options;
    options.profile = seed % 2 == 0 ? RasterProfile::kGsplat14 : RasterProfile::kGsplat15;
    options.mode = kRenderModes[seed / 2 % 3];
    options.compensated_from = seed % 4 == 3 ? 0.05f : 0.0f;
    options.background = {0.3f, 0.0f, 1.0f};
    const GaussianCloud cloud = RandomCloud(seed, {.gaussians = 150, .degree = 1, .largest = 0.5});
    const Camera camera = RandomCamera(seed, 35, 18);
    SCOPED_TRACE(seed);
    ExpectGradientMatches(cloud, camera, options, RandomLoss(seed, cloud, camera, options), {.stride = 17});
  }
}

// More Gaussians on a tile than one batch holds, most of them behind an opaque front, so that pixels stop at different
// batches.
TEST(RasterizerBackward, MatchesDifferenceQuotientsOfManyLayers) {
  for (uint64_t seed = 30; seed < 32; ++seed) {
    GaussianCloud cloud = RandomCloud(seed, {.gaussians = 900, .degree = 0, .smallest = 0.05, .largest = 0.5});
    for (float& logit : cloud.opacity_logits) logit = seed == 30 ? 0.3f * logit - 4.5f : 0.5f * logit - 2.0f;
    const Camera camera = RandomCamera(seed, 20, 17);
    LinearLoss loss = RandomLoss(seed, cloud, camera, Smooth(), false);
    SCOPED_TRACE(seed);
    ExpectGradientMatches(cloud, camera, Smooth(), loss, {.stride = 211});
  }
}

TEST(RasterizerBackward, LowerDegreeInUseLeavesTheOthersAtZero) {
  RenderOptions options = Smooth();
  options.sh_degree = 1;
  const GaussianCloud cloud = RandomCloud(40, {.gaussians = 10});
  const Camera camera = RandomCamera(40, 16, 16);
  const LinearLoss loss = RandomLoss(40, cloud, camera, options);
  ExpectGradientMatches(cloud, camera, options, loss);
  const CloudGradient gradient = Gradient(cloud, camera, options, loss.weights);
  for (size_t i = 0; i < 10; ++i) {
    for (size_t k = 12; k < 48; ++k) EXPECT_EQ(gradient.sh[48 * i + k], 0.0f);
  }
}

TEST(RasterizerBackward, CappedAlphaTeachesColourOnly) {
  // Nearly opaque everywhere on the picture.
  GaussianCloud cloud = OneGaussian(0, 0, 3, 50, 0.5);
  cloud.opacity_logits[0] = 12;
  const Camera camera = FrontCamera(16, 16, 40);
  const LinearLoss loss = RandomLoss(1, cloud, camera, {});
  const CloudGradient gradient = Gradient(cloud, camera, {}, loss.weights);
  EXPECT_EQ(gradient.opacity_logits[0], 0.0f);
  for (size_t a = 0; a < 3; ++a) {
    EXPECT_EQ(gradient.log_scales[a], 0.0f);
    EXPECT_EQ(gradient.means[a], 0.0f);
    double sum = 0;
    for (int64_t i = 0; i < 256; ++i) sum += loss.weights.color.channel(static_cast<int>(a))[i];
    EXPECT_NEAR(gradient.sh[a], 0.999 * kSh0 * sum, 1e-4);
    EXPECT_NEAR(gradient.background[a], 0.001 * sum, 1e-4);
  }
  // What lies behind still has its gradient.
  GaussianCloud two = cloud;
  ASSERT_TRUE(Append(two, OneGaussian(0.1, 0, 4, 0.4, 0.6)).ok());
  ExpectGradientMatches(two, camera, Smooth(), RandomLoss(2, two, camera, Smooth()));
}

TEST(RasterizerBackward, ColoursClampedAtZeroTeachNothing) {
  const GaussianCloud cloud = OneGaussian(0.1, 0, 3, 0.3, 0.7, {0.5f, -0.4f, 0.3f});
  const Camera camera = FrontCamera(16, 16, 30);
  const LinearLoss loss = RandomLoss(3, cloud, camera, Smooth());
  ExpectGradientMatches(cloud, camera, Smooth(), loss);
  const CloudGradient gradient = Gradient(cloud, camera, Smooth(), loss.weights);
  EXPECT_NE(gradient.sh[0], 0.0f);
  EXPECT_EQ(gradient.sh[1], 0.0f);
  EXPECT_NE(gradient.sh[2], 0.0f);
}

TEST(RasterizerBackward, ClampedJacobianMatches) {
  // Means beyond 30 % outside of the picture, in x, in y and in both, large enough to reach into it.
  GaussianCloud cloud = OneGaussian(2.5, 0.2, 3, 1.0, 0.8);
  for (const auto& [x, y] : {std::pair{-2.4, 0.1}, {0.1, 2.5}, {-2.5, -2.6}}) {
    ASSERT_TRUE(Append(cloud, OneGaussian(x, y, 3.1 + 0.01 * x, 1.1, 0.6)).ok());
  }
  for (size_t i = 0; i < cloud.quats.size(); ++i) cloud.quats[i] += 0.1f * static_cast<float>(i % 5);
  for (size_t i = 0; i < 4; ++i) cloud.log_scales[3 * i + 1] -= 0.5f;
  const Camera camera = FrontCamera(16, 16, 16);
  ExpectGradientMatches(cloud, camera, Smooth(), RandomLoss(4, cloud, camera, Smooth()));
}

TEST(RasterizerBackward, NeedlesKeepTheirDigits) {
  GaussianCloud cloud = RandomCloud(50, {.gaussians = 8, .degree = 0});
  for (size_t i = 0; i < 8; ++i) {
    cloud.log_scales[3 * i] = 0.5f;  // longer than the picture is wide
    cloud.log_scales[3 * i + 1] = -7.0f;
    cloud.log_scales[3 * i + 2] = i % 2 == 0 ? -kInfinity : -8.0f;
    for (size_t a = 0; a < 3; ++a) cloud.means[3 * i + a] *= 0.3f;
  }
  const Camera camera = RandomCamera(50, 48, 33);
  const LinearLoss loss = RandomLoss(50, cloud, camera, Smooth());
  ExpectGradientMatches(cloud, camera, Smooth(), loss, {.relative = 5e-3, .absolute = 5e-4});
}

TEST(RasterizerBackward, QuaternionGradientIsOrthogonalAndScalesWithTheNorm) {
  GaussianCloud cloud = RandomCloud(60, {.gaussians = 5, .degree = 0});
  const Camera camera = RandomCamera(60, 16, 16);
  const LinearLoss loss = RandomLoss(60, cloud, camera, Smooth());
  const CloudGradient gradient = Gradient(cloud, camera, Smooth(), loss.weights);
  for (size_t i = 0; i < 5; ++i) {
    double along = 0, size = 0;
    for (size_t a = 0; a < 4; ++a) {
      along += double{cloud.quats[4 * i + a]} * gradient.quats[4 * i + a];
      size += std::abs(cloud.quats[4 * i + a] * gradient.quats[4 * i + a]);
    }
    EXPECT_NEAR(along, 0, 1e-5 * size + 1e-9);
  }
  for (float& q : cloud.quats) q *= 1e-12f;
  const CloudGradient tiny = Gradient(cloud, camera, Smooth(), loss.weights);
  for (size_t i = 0; i < 20; ++i)
    EXPECT_NEAR(tiny.quats[i] * 1e-12, gradient.quats[i], 1e-4 * std::abs(gradient.quats[i]) + 1e-6);
}

TEST(RasterizerBackward, WhatIsNotSeenHasNoGradient) {
  GaussianCloud cloud = OneGaussian(0, 0, 3, 0.2, 0.8);
  ASSERT_TRUE(Append(cloud, OneGaussian(0, 0, -3, 0.2, 0.8)).ok());     // 1: behind the camera
  ASSERT_TRUE(Append(cloud, OneGaussian(50, 0, 3, 0.2, 0.8)).ok());     // 2: off the picture
  ASSERT_TRUE(Append(cloud, OneGaussian(0, 0, 2, 0.2, 0.8)).ok());      // 3: NaN
  ASSERT_TRUE(Append(cloud, OneGaussian(0.1, 0, 3.5, 0.2, 0.8)).ok());  // 4: the zero quaternion
  ASSERT_TRUE(Append(cloud, OneGaussian(0, 0.1, 3.6, 0.2, 0.8)).ok());  // 5: scale 0
  ASSERT_TRUE(Append(cloud, OneGaussian(0, 0.1, 2.5, 0.2, 0.8)).ok());  // 6: invisible
  ASSERT_TRUE(Append(cloud, OneGaussian(0, 0, 1e6, 1e8, 0.5)).ok());    // 7: enormous
  ASSERT_TRUE(Append(cloud, OneGaussian(0, 0, 3, 0.2, 0.5)).ok());      // 8: of infinite scale
  cloud.means[9] = std::nanf("");
  std::fill_n(&cloud.quats[16], 4, 0.0f);
  std::fill_n(&cloud.log_scales[15], 3, -kInfinity);
  cloud.opacity_logits[6] = -kInfinity;
  cloud.log_scales[24] = kInfinity;
  const Camera camera = FrontCamera(33, 20, 30);
  RenderGradient weights{Image(33, 20, 3), {}, {0, 0, 33, 20}};
  std::fill(weights.color.pixels.begin(), weights.color.pixels.end(), 1.0f);
  const CloudGradient gradient = Gradient(cloud, camera, {}, weights);
  for (const Buffer<float>* values : {&gradient.means, &gradient.log_scales, &gradient.quats, &gradient.opacity_logits,
                                      &gradient.sh, &gradient.means2d}) {
    for (const float g : *values) EXPECT_TRUE(std::isfinite(g));
  }
  for (const size_t i : {1, 2, 3, 6, 8}) {
    EXPECT_EQ(gradient.opacity_logits[i], 0.0f) << i;
    EXPECT_EQ(gradient.sh[3 * i], 0.0f) << i;
    EXPECT_EQ(gradient.means[3 * i], 0.0f) << i;
  }
  for (const size_t i : {0, 4, 5, 7}) {
    EXPECT_NE(gradient.opacity_logits[i], 0.0f) << i;
    EXPECT_NE(gradient.sh[3 * i], 0.0f) << i;
    EXPECT_GT(gradient.radii[2 * i], 0) << i;
  }
  for (const size_t i : {1, 2, 3, 8}) EXPECT_EQ(gradient.radii[2 * i], 0) << i;
  for (size_t a = 0; a < 4; ++a) EXPECT_EQ(gradient.quats[16 + a], 0.0f);
  for (size_t a = 0; a < 3; ++a) EXPECT_EQ(gradient.log_scales[15 + a], 0.0f);
}

TEST(RasterizerBackward, MeanGradientInThePictureIsPerPixel) {
  // Moving the principal point moves every mean in the picture.
  const GaussianCloud cloud = OneGaussian(0.1, -0.05, 3, 0.3, 0.7);
  Camera camera = FrontCamera(16, 16, 20);
  const LinearLoss loss = RandomLoss(5, cloud, camera, Smooth());
  const CloudGradient gradient = Gradient(cloud, camera, Smooth(), loss.weights);
  const auto at = [&](double dx, double dy) {
    Camera moved = camera;
    moved.intrinsics.cx += dx;
    moved.intrinsics.cy += dy;
    return loss(reference::ProjectAll(cloud, moved, Smooth()), Smooth());
  };
  EXPECT_NEAR(gradient.means2d[0], (at(1e-4, 0) - at(-1e-4, 0)) / 2e-4, 1e-4);
  EXPECT_NEAR(gradient.means2d[1], (at(0, 1e-4) - at(0, -1e-4)) / 2e-4, 1e-4);
}

TEST(RasterizerBackward, AnEmptyCloudLeavesTheBackground) {
  GaussianCloud cloud;
  cloud.Resize(0, 3);
  RenderGradient weights{Image(20, 10, 3), {}, {0, 0, 20, 10}};
  std::fill(weights.color.pixels.begin(), weights.color.pixels.end(), 0.5f);
  const CloudGradient gradient = Gradient(cloud, FrontCamera(20, 10, 10), {}, weights);
  EXPECT_TRUE(gradient.means.empty() && gradient.sh.empty() && gradient.radii.empty());
  for (const float b : gradient.background) EXPECT_EQ(b, 100.0f);
}

bool SameBits(const CloudGradient& a, const CloudGradient& b) {
  return a.means == b.means && a.log_scales == b.log_scales && a.quats == b.quats &&
         a.opacity_logits == b.opacity_logits && a.sh == b.sh && a.means2d == b.means2d && a.radii == b.radii &&
         a.background == b.background;
}

TEST(RasterizerBackward, NeitherThreadsNorRunsOfTilesChangeABit) {
  const GaussianCloud cloud = RandomCloud(70, {.gaussians = 20000, .degree = 2, .smallest = 0.005, .largest = 0.08});
  const Camera camera = RandomCamera(70, 150, 83);
  RenderOptions options;
  const LinearLoss loss = RandomLoss(70, cloud, camera, options);
  SetThreadCount(1);
  const CloudGradient one = Gradient(cloud, camera, options, loss.weights);
  for (const int threads : {1, 2, 5}) {
    SetThreadCount(threads);
    for (const int64_t pairs : {kMaxPairs, int64_t{3000}}) {
      options.max_pairs = pairs;
      EXPECT_TRUE(SameBits(Gradient(cloud, camera, options, loss.weights), one)) << threads << ", " << pairs;
    }
  }
  SetThreadCount(0);
}

TEST(RasterizerBackward, OutsideOfTheBoxNothingIsRead) {
  const GaussianCloud cloud = RandomCloud(71, {.gaussians = 300, .degree = 1});
  const Camera camera = RandomCamera(71, 70, 45);
  LinearLoss loss = RandomLoss(71, cloud, camera, {});
  loss.weights.box = {5, 13, 38, 41};
  RenderGradient inside = loss.weights, outside = loss.weights;
  inside.box = {0, 0, 70, 45};
  for (int y = 0; y < 45; ++y) {
    for (int x = 0; x < 70; ++x) {
      if (x >= 5 && x < 38 && y >= 13 && y < 41) continue;
      for (int c = 0; c < 3; ++c) {
        inside.color.at(c, y, x) = 0;
        outside.color.at(c, y, x) = std::nanf("");
      }
      inside.alpha.at(0, y, x) = 0;
      outside.alpha.at(0, y, x) = std::nanf("");
    }
  }
  const CloudGradient expected = Gradient(cloud, camera, {}, inside);
  EXPECT_TRUE(SameBits(Gradient(cloud, camera, {}, outside), expected));
  outside.box = {};
  for (const float g : Gradient(cloud, camera, {}, outside).sh) EXPECT_EQ(g, 0.0f);
}

TEST(RasterizerBackward, EveryInstructionSetMatches) {
  const GaussianCloud cloud = RandomCloud(72, {.gaussians = 10, .degree = 3});
  const Camera camera = RandomCamera(72, 19, 18);
  const LinearLoss loss = RandomLoss(72, cloud, camera, Smooth());
  ForEachSimdTarget([&] { ExpectGradientMatches(cloud, camera, Smooth(), loss, {.stride = 7}); });
  SkipWhenOnlyOneSimdTarget();
}

// Both are links of the same chain: σ(x) and the constant harmonic are what lies between them.
TEST(RasterizerBackward, WhatIsSeenIsWhereBackwardBegins) {
  for (const RenderMode mode : {RenderMode::kClassic, RenderMode::kAntialiased}) {
    GaussianCloud cloud = RandomCloud(74, {.gaussians = 400, .degree = 1, .smallest = 0.005, .largest = 0.3});
    for (size_t k = 0; k < 3; ++k) cloud.sh[static_cast<size_t>(cloud.sh_stride()) + k] = -9;  // clamped
    cloud.opacity_logits[2] = -kInfinity;                                                      // culled
    cloud.means[9] = std::nanf("");
    const Camera camera = RandomCamera(74, 70, 45);
    RenderOptions options;
    options.mode = mode;
    options.gradient = true;
    const LinearLoss loss = RandomLoss(74, cloud, camera, options);
    const CloudGradient whole = Gradient(cloud, camera, options, loss.weights);
    Rasterizer rasterizer;
    RenderOutput output;
    ASSERT_TRUE(rasterizer.Render(cloud, camera, options, output).ok());
    const auto seen = rasterizer.BackwardToAppearance(cloud, loss.weights);
    ASSERT_TRUE(seen.ok()) << seen.error().message;
    EXPECT_TRUE(std::equal(seen->radii.begin(), seen->radii.end(), whole.radii.begin(), whole.radii.end()));
    int64_t taught = 0;
    for (int64_t i = 0; i < cloud.size(); ++i) {
      const double opacity = 1 / (1 + std::exp(-double{cloud.opacity_logits[static_cast<size_t>(i)]}));
      const double expected = whole.opacity_logits[static_cast<size_t>(i)];
      EXPECT_NEAR(seen->OfLogOpacity(i) * (1 - opacity), expected, 1e-5 * std::abs(expected)) << i;
      for (size_t c = 0; c < 3; ++c) {
        const double of_term = whole.sh[static_cast<size_t>(i * cloud.sh_stride()) + c];
        EXPECT_NEAR(double{kSh0} * seen->OfColor(i, c), of_term, 1e-6 * std::abs(of_term)) << i;
      }
      taught += expected != 0;
    }
    EXPECT_GT(taught, 100);
  }
}

TEST(RasterizerBackward, RefusesWhatDoesNotBelongToThePicture) {
  const GaussianCloud cloud = RandomCloud(73, {.gaussians = 20, .degree = 1});
  const Camera camera = RandomCamera(73, 16, 16);
  Rasterizer rasterizer;
  RenderOutput output;
  CloudGradient gradient;
  RenderGradient weights{Image(16, 16, 3), {}, {0, 0, 16, 16}};
  std::fill(weights.color.pixels.begin(), weights.color.pixels.end(), 0.0f);
  const auto message = [&](const GaussianCloud& c) {
    const Status status = rasterizer.Backward(c, weights, gradient);
    return status.ok() ? std::string() : status.error().message;
  };
  EXPECT_NE(message(cloud).find("RenderOptions::gradient"), std::string::npos);
  EXPECT_FALSE(rasterizer.BackwardToAppearance(cloud, weights).ok());
  RenderOptions options;
  options.gradient = true;
  ASSERT_TRUE(rasterizer.Render(cloud, camera, options, output).ok());
  EXPECT_EQ(message(cloud), "");
  const GaussianCloud larger = RandomCloud(73, {.gaussians = 21, .degree = 1});
  EXPECT_NE(message(larger).find("21"), std::string::npos);
  EXPECT_FALSE(rasterizer.BackwardToAppearance(larger, weights).ok());
  EXPECT_NE(message(WithShDegree(cloud, 2)).find("degree 2"), std::string::npos);
  EXPECT_TRUE(rasterizer.BackwardToAppearance(cloud, weights).ok());
  weights.box = {0, 0, 17, 16};
  EXPECT_FALSE(rasterizer.BackwardToAppearance(cloud, weights).ok());
  EXPECT_NE(message(cloud).find("17"), std::string::npos);
  weights.box = {0, 0, 16, 16};
  weights.alpha = Image(16, 15, 1);
  EXPECT_NE(message(cloud).find("16 x 15"), std::string::npos);
  weights.alpha = Image();
  weights.color = Image(16, 16, 1);
  EXPECT_NE(message(cloud).find("16 x 16 x 1"), std::string::npos);
  // A later picture without the option leaves nothing to take a gradient of.
  options.gradient = false;
  ASSERT_TRUE(rasterizer.Render(cloud, camera, options, output).ok());
  EXPECT_NE(message(cloud), "");
}

}  // namespace
}  // namespace anchorsplat
