#include "render/rasterizer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "core/parallel.h"
#include "core/simd_targets_for_test.h"
#include "core/text.h"
#include "render/rasterizer_reference.h"
#include "render/scenes_for_test.h"

namespace anchorsplat {
namespace {

using test::FrontCamera;
using test::OneGaussian;
using test::RandomCamera;
using test::RandomCloud;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

RenderOutput Render(const GaussianCloud& cloud, const Camera& camera, const RenderOptions& options = {}) {
  Rasterizer rasterizer;
  RenderOutput output;
  const Status status = rasterizer.Render(cloud, camera, options, output);
  EXPECT_TRUE(status.ok()) << status.error().message;
  return output;
}

struct Difference {
  double color = 0, alpha = 0, depth = 0;  // largest, away from the cut-offs
  int64_t compared = 0, left_out = 0;      // pixels
};

// Compares every `step`-th pixel. A pixel where an α comes within 1e-3 of the 1/255 cut-off or a T within 1e-3 of the
// 1e-4 cut-off (both relative) is left out: rounding may decide either way there.
Difference Compare(const RenderOutput& output, const GaussianCloud& cloud, const Camera& camera,
                   const RenderOptions& options, int64_t step = 1) {
  const auto splats = reference::ProjectAll(cloud, camera, options);
  Difference difference;
  for (int64_t i = 0; i < output.color.plane(); i += step) {
    const int x = static_cast<int>(i % output.color.width), y = static_cast<int>(i / output.color.width);
    const reference::Pixel expected = reference::Blend(splats, x, y, options);
    if (expected.margin < 1e-3) {
      ++difference.left_out;
      continue;
    }
    ++difference.compared;
    const auto raise = [](double& largest, double d) {
      if (!(d <= largest)) largest = d;  // NaN, too
    };
    for (int c = 0; c < 3; ++c) {
      raise(difference.color, std::abs(output.color.at(c, y, x) - expected.rgb[static_cast<size_t>(c)]));
    }
    raise(difference.alpha, std::abs(output.alpha.at(0, y, x) - expected.alpha));
    if (options.depth) raise(difference.depth, std::abs(output.depth.at(0, y, x) - expected.depth));
  }
  return difference;
}

void ExpectMatchesReference(const GaussianCloud& cloud, const Camera& camera, const RenderOptions& options,
                            int64_t step = 1) {
  const Difference d = Compare(Render(cloud, camera, options), cloud, camera, options, step);
  EXPECT_LE(d.color, 2e-5);
  EXPECT_LE(d.alpha, 2e-5);
  EXPECT_LE(d.depth, 2e-5);
  EXPECT_LE(d.left_out, d.compared / 10 + 1);
}

TEST(Rasterizer, MatchesReferenceOnRandomClouds) {
  const std::array<std::array<int, 2>, 5> sizes = {{{67, 41}, {16, 16}, {1, 1}, {131, 93}, {33, 70}}};
  for (uint64_t seed = 0; seed < 40; ++seed) {
    const auto& size = sizes[seed % sizes.size()];
    RenderOptions options;
    options.profile = seed % 2 == 0 ? RasterProfile::kGsplat14 : RasterProfile::kGsplat15;
    options.mode = kRenderModes[seed / 2 % 3];
    options.compensated_from = seed % 4 == 3 ? 0.05f : 0.0f;
    options.background = {0.3f, static_cast<float>(seed % 3) * 0.5f, 1.0f};
    options.sh_degree = static_cast<int>(seed / 3 % 4);
    options.depth = seed % 4 != 3;
    SCOPED_TRACE(seed);
    ExpectMatchesReference(RandomCloud(seed, {.degree = static_cast<int>(seed / 5 % 4)}),
                           RandomCamera(seed, size[0], size[1]), options);
  }
}

TEST(Rasterizer, MatchesReferenceOnTheExamples) {
  for (const char* name : {"biplane", "stone_lantern"}) {
    const GaussianCloud cloud = test::ReadExample(name);
    ASSERT_GE(cloud.size(), 19999) << name;
    const auto set = OrbitCameras(3, 1.7, {0, 0, 0}, PinholeFromFov(1024, 1024, std::numbers::pi / 4));
    ASSERT_TRUE(set.ok());
    RenderOptions options;
    options.depth = true;
    for (const Camera& camera : set->cameras) {
      SCOPED_TRACE(std::string(name) + " " + camera.name);
      ExpectMatchesReference(cloud, camera, options, 1009);
    }
  }
}

TEST(Rasterizer, MatchesReferenceWithThousandsOfLayers) {
  // More Gaussians per tile than one batch of the blending stage, nearly transparent so that none of them stops it.
  GaussianCloud cloud = RandomCloud(5, {.gaussians = 3000, .degree = 0, .smallest = 0.05, .largest = 0.5});
  for (float& logit : cloud.opacity_logits) logit = logit * 0.3f - 4.5f;
  RenderOptions options;
  options.depth = true;
  const Camera camera = RandomCamera(5, 37, 29);
  const RenderOutput output = Render(cloud, camera, options);
  const auto splats = reference::ProjectAll(cloud, camera, options);
  double largest = 0;
  for (int y = 0; y < 29; ++y) {
    for (int x = 0; x < 37; ++x) {
      const reference::Pixel expected = reference::Blend(splats, x, y, options);
      if (expected.margin < 1e-5) continue;  // with so many layers, few pixels are far from all cut-offs
      largest = std::max(largest, std::abs(output.color.at(0, y, x) - expected.rgb[0]));
    }
  }
  EXPECT_LE(largest, 2e-5);
}

TEST(Rasterizer, NeedlesAndGiantsMatchReference) {
  for (uint64_t seed = 100; seed < 110; ++seed) {
    GaussianCloud cloud = RandomCloud(seed, {.gaussians = 60, .degree = 1});
    for (size_t i = 0; i < 60; ++i) {
      cloud.log_scales[3 * i] = i % 2 == 0 ? 0.5f : -kInfinity;  // longer than the image is wide, or flat
      if (i % 3 == 0) cloud.log_scales[3 * i + 1] = cloud.log_scales[3 * i + 2] = -9.0f;
      if (i % 7 == 0) cloud.log_scales[3 * i + 1] = 3.0f;
    }
    RenderOptions options;
    options.profile = seed % 2 == 0 ? RasterProfile::kGsplat14 : RasterProfile::kGsplat15;
    SCOPED_TRACE(seed);
    ExpectMatchesReference(cloud, RandomCamera(seed, 150, 77), options);
  }
}

TEST(Rasterizer, WithoutCutOffsMatchesReference) {
  RenderOptions options;
  options.min_alpha = 1e-9f;
  options.min_transmittance = 0;
  const GaussianCloud cloud = RandomCloud(3);
  const Camera camera = RandomCamera(3, 67, 41);
  const RenderOutput output = Render(cloud, camera, options);
  const auto splats = reference::ProjectAll(cloud, camera, options);
  for (int y = 0; y < 41; ++y) {
    for (int x = 0; x < 67; ++x) {
      const reference::Pixel expected = reference::Blend(splats, x, y, options);
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(output.color.at(c, y, x), expected.rgb[static_cast<size_t>(c)], 2e-5);
    }
  }
}

TEST(Rasterizer, EveryInstructionSetGivesTheSamePicture) {
  const GaussianCloud cloud = RandomCloud(11);
  const Camera camera = RandomCamera(11, 67, 41);
  RenderOptions options;
  options.depth = true;
  ForEachSimdTarget([&] { ExpectMatchesReference(cloud, camera, options); });
  SkipWhenOnlyOneSimdTarget();
}

void ExpectSameBits(const RenderOutput& a, const RenderOutput& b) {
  EXPECT_EQ(a.color.pixels, b.color.pixels);
  EXPECT_EQ(a.alpha.pixels, b.alpha.pixels);
  EXPECT_EQ(a.depth.pixels, b.depth.pixels);
}

TEST(Rasterizer, ThreadCountDoesNotChangeABit) {
  // Enough Gaussians that sorting and binning really are split.
  const GaussianCloud cloud = RandomCloud(21, {.gaussians = 30000, .degree = 1, .smallest = 0.002, .largest = 0.05});
  const Camera camera = RandomCamera(21, 203, 149);
  RenderOptions options;
  options.depth = true;
  SetThreadCount(1);
  const RenderOutput one = Render(cloud, camera, options);
  for (const int threads : {2, 5}) {
    SetThreadCount(threads);
    ExpectSameBits(one, Render(cloud, camera, options));
  }
  SetThreadCount(0);
}

TEST(Rasterizer, RunsOfTilesDoNotChangeABit) {
  const GaussianCloud cloud = RandomCloud(22, {.gaussians = 2000});
  const Camera camera = RandomCamera(22, 203, 149);
  RenderOptions options;
  const RenderOutput whole = Render(cloud, camera, options);
  Rasterizer rasterizer;
  RenderOutput output;
  for (const int64_t max_pairs : {1, 1000, 5000}) {
    options.max_pairs = max_pairs;
    ASSERT_TRUE(rasterizer.Render(cloud, camera, options, output).ok());
    EXPECT_GT(rasterizer.statistics().runs, 2);
    ExpectSameBits(whole, output);
  }
}

TEST(Rasterizer, ReusedObjectForgetsTheLastPicture) {
  Rasterizer rasterizer;
  RenderOutput output;
  RenderOptions options;
  options.depth = true;
  ASSERT_TRUE(rasterizer.Render(RandomCloud(1), RandomCamera(1, 131, 93), options, output).ok());
  for (const uint64_t seed : {2, 3}) {
    const GaussianCloud cloud = RandomCloud(seed, {.gaussians = 200});
    const Camera camera = RandomCamera(seed, 50, 71);
    ASSERT_TRUE(rasterizer.Render(cloud, camera, options, output).ok());
    ExpectSameBits(Render(cloud, camera, options), output);
  }
}

TEST(Rasterizer, OneGaussianByHand) {
  // Focal 100, z 2, scale 0.1: 5 px, so variance 25 + 0.3 px². The mean falls on (8, 8), the corner of four pixels.
  const GaussianCloud cloud = OneGaussian(0, 0, 2, 0.1, 0.6);
  RenderOptions options;
  options.background = {0.1f, 0.2f, 0.3f};
  options.depth = true;
  const RenderOutput output = Render(cloud, FrontCamera(16, 16, 100), options);
  const double near_alpha = 0.6 * std::exp(-0.5 * (0.5 * 0.5 + 0.5 * 0.5) / 25.3);
  const double far_alpha = 0.6 * std::exp(-0.5 * (4.5 * 4.5 + 1.5 * 1.5) / 25.3);
  for (const auto& [x, y] : {std::pair{7, 7}, {8, 7}, {7, 8}, {8, 8}}) {
    EXPECT_NEAR(output.alpha.at(0, y, x), near_alpha, 1e-6);
    EXPECT_NEAR(output.color.at(0, y, x), near_alpha * 0.9 + (1 - near_alpha) * 0.1, 1e-6);
    EXPECT_NEAR(output.color.at(1, y, x), near_alpha * 0.5 + (1 - near_alpha) * 0.2, 1e-6);
    EXPECT_NEAR(output.color.at(2, y, x), near_alpha * 0.2 + (1 - near_alpha) * 0.3, 1e-6);
    EXPECT_NEAR(output.depth.at(0, y, x), 2, 1e-5);
  }
  EXPECT_NEAR(output.alpha.at(0, 9, 3), far_alpha, 1e-6);
}

TEST(Rasterizer, AntialiasedDimsWhatTheDilationWidened) {
  // 0.5 px at z 2: variance 0.25 px² of 0.55 px² after dilation.
  const GaussianCloud cloud = OneGaussian(0.01, 0.01, 2, 0.01, 0.6);  // mean on the centre of pixel (8, 8)
  RenderOptions options;
  options.mode = RenderMode::kAntialiased;
  const RenderOutput output = Render(cloud, FrontCamera(16, 16, 100), options);
  EXPECT_NEAR(output.alpha.at(0, 8, 8), 0.6 * 0.25 / 0.55, 1e-5);  // the Jacobian is 1 + 1e-5 so near the axis
  // What a closer view with a dilation of its own shows of it, averaged.
  options.dilation = 0.4f;
  options.compensated_from = 0.1f;
  EXPECT_NEAR(Render(cloud, FrontCamera(16, 16, 100), options).alpha.at(0, 8, 8), 0.6 * 0.35 / 0.65, 1e-5);
}

TEST(Rasterizer, MipWidensByATenthOfAPixel) {
  const GaussianCloud cloud = OneGaussian(0.01, 0.01, 2, 0.01, 0.6);  // 0.25 px², on the centre of pixel (8, 8)
  const Camera camera = FrontCamera(16, 16, 100);
  RenderOptions options;
  options.mode = RenderMode::kMip;
  const RenderOutput output = Render(cloud, camera, options);
  EXPECT_NEAR(output.alpha.at(0, 8, 8), 0.6 * 0.25 / 0.35, 1e-5);
  EXPECT_NEAR(output.alpha.at(0, 8, 9), 0.6 * 0.25 / 0.35 * std::exp(-0.5 / 0.35), 1e-4);
  // A dilation that was said counts in every mode.
  options.dilation = kDilation;
  const RenderOutput wide = Render(cloud, camera, options);
  options.mode = RenderMode::kAntialiased;
  options.dilation.reset();
  EXPECT_EQ(Render(cloud, camera, options).alpha.pixels, wide.alpha.pixels);
}

TEST(Rasterizer, ProfilesDifferOnlyInTheTilesBeyondThreeSigma) {
  // Variance 36.3 px² at (40, 40): ceil(3σ) = 19 px ends at tile column 4 (64 px) exactly; 3.33σ = 20.06 → 21 px.
  const GaussianCloud cloud = OneGaussian(0, 0, 2, 0.12, 0.995);
  Camera camera = FrontCamera(96, 96, 100);
  camera.intrinsics.cx = camera.intrinsics.cy = 45;
  RenderOptions options;
  const RenderOutput old_profile = Render(cloud, camera, options);
  options.profile = RasterProfile::kGsplat15;
  const RenderOutput new_profile = Render(cloud, camera, options);
  // 45 + 19 = 64: tile column 4 is outside of the old square, inside of the new one (45 + 21 = 66).
  EXPECT_EQ(old_profile.alpha.at(0, 45, 64), 0.0f);
  EXPECT_GT(new_profile.alpha.at(0, 45, 64), 0.0f);
  EXPECT_EQ(old_profile.alpha.at(0, 45, 63), new_profile.alpha.at(0, 45, 63));
}

TEST(Rasterizer, EmptyCloudIsBackground) {
  RenderOptions options;
  options.background = {0.25f, 0.5f, 0.75f};
  options.depth = true;
  for (const int degree : {0, 3}) {
    GaussianCloud cloud;
    cloud.Resize(0, degree);
    const RenderOutput output = Render(cloud, FrontCamera(19, 5, 10), options);
    ASSERT_EQ(output.color.pixels.size(), 3u * 19 * 5);
    for (int c = 0; c < 3; ++c) {
      for (int i = 0; i < 19 * 5; ++i)
        EXPECT_EQ(output.color.channel(c)[i], options.background[static_cast<size_t>(c)]);
    }
    for (const float a : output.alpha.pixels) EXPECT_EQ(a, 0.0f);
    for (const float z : output.depth.pixels) EXPECT_EQ(z, 0.0f);
  }
}

TEST(Rasterizer, CullsOutsideNearAndFar) {
  RenderOptions options;
  options.far_plane = 5;
  const Camera camera = FrontCamera(16, 16, 20);
  const auto drawn = [&](double z) {
    const RenderOutput output = Render(OneGaussian(0, 0, z, 0.05, 0.9), camera, options);
    return output.alpha.at(0, 8, 8) > 0;
  };
  EXPECT_TRUE(drawn(1));
  EXPECT_TRUE(drawn(0.011));
  EXPECT_FALSE(drawn(0.009));
  EXPECT_FALSE(drawn(0));
  EXPECT_FALSE(drawn(-1));
  EXPECT_TRUE(drawn(4.99));
  EXPECT_FALSE(drawn(5.01));
}

TEST(Rasterizer, NearerOneIsInFrontAndTiesGoByRow) {
  const Camera camera = FrontCamera(16, 16, 100);
  GaussianCloud cloud = OneGaussian(0, 0, 3, 0.2, 0.95, {1, 0, 0});
  ASSERT_TRUE(Append(cloud, OneGaussian(0, 0, 2, 0.2, 0.95, {0, 1, 0})).ok());
  RenderOutput output = Render(cloud, camera);
  EXPECT_GT(output.color.at(1, 8, 8), 0.9f);
  EXPECT_LT(output.color.at(0, 8, 8), 0.1f);
  cloud.means[2] = 2;  // the same depth: row 0 first
  output = Render(cloud, camera);
  EXPECT_GT(output.color.at(0, 8, 8), 0.9f);
}

TEST(Rasterizer, OpaqueStackStopsBeforeTheCutOff) {
  // α = 0.999 each: T = 1e-3 after the first; the second would bring 1e-6 ≤ 1e-4 and is not added.
  GaussianCloud cloud;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(Append(cloud, OneGaussian(0, 0, 2 + i, 5, 0.99999)).ok());
  }
  const RenderOutput output = Render(cloud, FrontCamera(16, 16, 100));
  EXPECT_NEAR(output.alpha.at(0, 8, 8), 0.999, 1e-6);
}

TEST(Rasterizer, SkipsWhatIsNotFinite) {
  const Camera camera = RandomCamera(31, 67, 41);
  const GaussianCloud good = RandomCloud(31, {.gaussians = 80});
  const RenderOutput expected = Render(good, camera);
  // The same cloud with spoilt copies in front of it.
  std::vector<int64_t> rows;
  for (int64_t i = 0; i < 80; ++i) rows.push_back(i);
  GaussianCloud spoilt = Subset(good, std::vector<int64_t>(50, 0)).value();
  for (size_t i = 0; i < 50; ++i) {
    const float bad = i % 3 == 0 ? std::nanf("") : i % 3 == 1 ? kInfinity : -kInfinity;
    const float bad_length = bad == -kInfinity ? kInfinity : bad;  // −Inf is legal
    switch (i % 5) {
      case 0:
        spoilt.means[3 * i + i % 3] = bad;
        break;
      case 1:
        spoilt.log_scales[3 * i + i % 3] = bad_length;
        break;
      case 2:
        spoilt.quats[4 * i + i % 4] = bad;
        break;
      case 3:
        spoilt.opacity_logits[i] = std::nanf("");  // both infinities are legal
        break;
      default:
        spoilt.sh[48 * i + i % 48] = bad;
    }
  }
  ASSERT_TRUE(Append(spoilt, good).ok());
  EXPECT_EQ(Render(spoilt, camera).color.pixels, expected.color.pixels);
}

TEST(Rasterizer, UnusedCoefficientsMayBeAnything) {
  GaussianCloud cloud = RandomCloud(32, {.gaussians = 50, .degree = 2});
  const Camera camera = RandomCamera(32, 40, 30);
  RenderOptions options;
  options.sh_degree = 1;
  const RenderOutput expected = Render(cloud, camera, options);
  for (size_t i = 0; i < 50; ++i) cloud.sh[27 * i + 12] = std::nanf("");
  EXPECT_EQ(Render(cloud, camera, options).color.pixels, expected.color.pixels);
}

TEST(Rasterizer, ExtremeValuesNeitherCrashNorSpread) {
  const Camera camera = FrontCamera(64, 48, 60);
  RenderOptions options;
  options.depth = true;
  for (const auto profile : {RasterProfile::kGsplat14, RasterProfile::kGsplat15}) {
    for (const RenderMode mode : kRenderModes) {
      for (const std::optional<float> dilation : {std::optional(0.0f), std::optional<float>()}) {
        options.profile = profile;
        options.mode = mode;
        options.dilation = dilation;
        Random random(7);
        GaussianCloud cloud;
        cloud.Resize(3000, 1);
        const std::array<float, 12> values = {0,      -0.0f, 1,      -1,      1e-38f,     3e38f,
                                              -3e38f, 88.0f, 300.0f, -1e-40f, -kInfinity, 0.5f};
        const auto any = [&] { return values[static_cast<size_t>(random.Below(12))]; };
        for (Buffer<float>* array : {&cloud.means, &cloud.log_scales, &cloud.quats, &cloud.opacity_logits, &cloud.sh}) {
          for (float& x : *array) x = random.Uniform() < 0.4 ? any() : static_cast<float>(random.Normal());
        }
        const RenderOutput output = Render(cloud, camera, options);
        for (const float a : output.alpha.pixels) ASSERT_TRUE(a >= 0 && a <= 1) << a;
        for (const float z : output.depth.pixels) ASSERT_FALSE(std::isnan(z));
      }
    }
  }
}

// One rule (core/gaussian_cloud.h) for what is drawn, whatever the view: of these, one fills the picture with it.
TEST(Rasterizer, DrawsWhatTheRuleSays) {
  const auto expect_alike = [](const GaussianCloud& cloud, const std::string& what) {
    for (const double focal : {0.5, 60.0, 1e6}) {
      for (const RenderMode mode : {RenderMode::kClassic, RenderMode::kMip}) {
        const RenderOutput output = Render(cloud, FrontCamera(16, 16, focal), {.mode = mode});
        EXPECT_EQ(*std::ranges::max_element(output.alpha.pixels) > 0, IsDrawn(cloud, 0)) << what << " focal " << focal;
        for (const float x : output.color.pixels) ASSERT_TRUE(std::isfinite(x)) << what;
      }
    }
  };
  for (double scale = 40; scale < 128; scale += 0.5) {
    for (size_t axes = 1; axes <= 3; ++axes) {
      GaussianCloud cloud = OneGaussian(0, 0, 3, 2, 0.9);
      std::fill_n(cloud.log_scales.begin(), axes, static_cast<float>(scale));
      expect_alike(cloud, Cat(axes, " axes of ", scale));
    }
  }
  for (const float length : {0.0f, 1e-44f, 1e-30f, 1e-20f, 1e20f, 1e30f, 3e38f}) {
    GaussianCloud cloud = OneGaussian(0, 0, 3, 2, 0.9);
    for (float& x : cloud.quats) x = length;
    expect_alike(cloud, Cat("a quaternion of ", length));
  }
  for (const float logit : {-kInfinity, -200.0f, -5.6f, -5.5f, 200.0f, kInfinity, std::nanf("")}) {
    GaussianCloud cloud = OneGaussian(0, 0, 3, 1e4, 0.9);
    cloud.opacity_logits = {logit};
    // A mode that compensates leaves less of one at the limit.
    if (logit == -5.5f) cloud.opacity_logits = {-5.4f};
    expect_alike(cloud, Cat("a logit of ", logit));
  }
  for (const float huge : {1e38f, 3e38f, -3e38f, kInfinity, std::nanf("")}) {
    for (int degree = 0; degree <= 3; ++degree) {
      GaussianCloud cloud = WithShDegree(OneGaussian(0, 0, 3, 2, 0.9), degree);
      for (float& x : cloud.sh) x = huge;
      expect_alike(cloud, Cat("coefficients of ", huge, ", degree ", degree));
    }
  }
}

TEST(Rasterizer, ZeroQuaternionIsTheIdentity) {
  GaussianCloud cloud = OneGaussian(0, 0, 2, 0.1, 0.6);
  cloud.log_scales[0] = -1.0f;
  const Camera camera = FrontCamera(32, 32, 50);
  const RenderOutput expected = Render(cloud, camera);
  cloud.quats.assign(4, 0.0f);
  EXPECT_EQ(Render(cloud, camera).color.pixels, expected.color.pixels);
}

TEST(Rasterizer, RefusesWhatItCannotDraw) {
  Rasterizer rasterizer;
  RenderOutput output;
  const GaussianCloud good = OneGaussian(0, 0, 2, 0.1, 0.6);
  const auto refused = [&](const GaussianCloud& cloud, const Camera& camera, const RenderOptions& options) {
    const Status status = rasterizer.Render(cloud, camera, options, output);
    return !status.ok() && status.error().code == ErrorCode::kBadArgument && !status.error().message.empty();
  };
  const Camera camera = FrontCamera(16, 16, 10);
  EXPECT_FALSE(refused(good, camera, {}));
  GaussianCloud odd = good;
  odd.quats.pop_back();
  EXPECT_TRUE(refused(odd, camera, {}));
  const auto with = [&](auto change) {
    Camera changed = camera;
    change(changed);
    return refused(good, changed, {});
  };
  EXPECT_TRUE(with([](Camera& c) { c.intrinsics.width = 0; }));
  EXPECT_TRUE(with([](Camera& c) { c.intrinsics.height = -4; }));
  EXPECT_TRUE(with([](Camera& c) { c.intrinsics.width = 1 << 30; }));
  EXPECT_TRUE(with([](Camera& c) { c.intrinsics.fx = 0; }));
  EXPECT_TRUE(with([](Camera& c) { c.intrinsics.fy = std::nan(""); }));
  EXPECT_TRUE(with([](Camera& c) { c.intrinsics.cx = INFINITY; }));
  EXPECT_TRUE(with([](Camera& c) { c.world_to_camera.translation[1] = std::nan(""); }));
  EXPECT_TRUE(refused(good, camera, {.near_plane = 0}));
  EXPECT_TRUE(refused(good, camera, {.dilation = -1}));
  EXPECT_TRUE(refused(good, camera, {.compensated_from = -0.1f}));
  EXPECT_TRUE(refused(good, camera, {.compensated_from = 0.4f}));
  EXPECT_TRUE(refused(good, camera, {.sh_degree = -1}));
  EXPECT_TRUE(refused(good, camera, {.min_alpha = 0}));
  EXPECT_TRUE(refused(good, camera, {.min_transmittance = 1}));
  EXPECT_TRUE(refused(good, camera, {.max_pairs = 0}));
}

}  // namespace
}  // namespace anchorsplat
