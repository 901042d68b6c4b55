// The absolute gradients of the centres (RenderOptions::absgrad) against a loop over pixels that reads like the
// formula.

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/parallel.h"
#include "core/simd_targets_for_test.h"
#include "render/gradient_check_for_test.h"
#include "render/scenes_for_test.h"

namespace anchorsplat {
namespace {

using test::FrontCamera;
using test::Gradient;
using test::LinearLoss;
using test::OneGaussian;
using test::RandomCamera;
using test::RandomCloud;
using test::RandomLoss;

// Sums over pixels of ∂L/∂x and ∂L/∂y of each Gaussian's centre in the picture: as they are, and of absolute values.
struct CentreGradients {
  std::vector<double> sums, absolute;  // [N,2] per pixel
};

CentreGradients Reference(const GaussianCloud& cloud, const Camera& camera, const RenderOptions& options,
                          const RenderGradient& weights) {
  const auto splats = reference::ProjectAll(cloud, camera, options);
  const auto n = static_cast<size_t>(cloud.size());
  CentreGradients out{std::vector<double>(2 * n), std::vector<double>(2 * n)};
  struct Layer {
    const reference::Splat* g;
    double dx, dy, alpha, transmittance;
    bool capped;
  };
  const Image& color = weights.color;
  for (int y = 0; y < color.height; ++y) {
    for (int x = 0; x < color.width; ++x) {
      std::vector<Layer> layers;
      double transmittance = 1;
      for (const reference::Splat& g : splats) {
        if (x / 16 < g.tile_x0 || x / 16 >= g.tile_x1 || y / 16 < g.tile_y0 || y / 16 >= g.tile_y1) continue;
        const double dx = g.x - (x + 0.5), dy = g.y - (y + 0.5);
        const double uncapped = g.opacity * std::exp(-0.5 * (g.a * dx * dx + g.c * dy * dy) - g.b * dx * dy);
        const double alpha = std::min<double>(kMaxAlpha, uncapped);
        if (alpha < options.min_alpha) continue;
        if (transmittance * (1 - alpha) <= options.min_transmittance) break;
        layers.push_back({&g, dx, dy, alpha, transmittance, uncapped > kMaxAlpha});
        transmittance *= 1 - alpha;
      }
      // What lies behind: C_behind as a weighted sum, ∂A/∂T = −1.
      double behind = weights.alpha.pixels.empty() ? 0 : -transmittance * weights.alpha.at(0, y, x);
      for (int c = 0; c < 3; ++c) {
        behind += transmittance * color.at(c, y, x) * options.background[static_cast<size_t>(c)];
      }
      for (auto layer = layers.rbegin(); layer != layers.rend(); ++layer) {
        const reference::Splat& g = *layer->g;
        double own = 0;
        for (int c = 0; c < 3; ++c) own += color.at(c, y, x) * g.rgb[static_cast<size_t>(c)];
        const double by_alpha = layer->transmittance * own - behind / (1 - layer->alpha);
        behind += layer->alpha * layer->transmittance * own;
        if (layer->capped) continue;
        const double by_x = -by_alpha * layer->alpha * (g.a * layer->dx + g.b * layer->dy);
        const double by_y = -by_alpha * layer->alpha * (g.b * layer->dx + g.c * layer->dy);
        const auto row = static_cast<size_t>(g.row);
        out.sums[2 * row] += by_x;
        out.sums[2 * row + 1] += by_y;
        out.absolute[2 * row] += std::abs(by_x);
        out.absolute[2 * row + 1] += std::abs(by_y);
      }
    }
  }
  return out;
}

void ExpectMatches(const GaussianCloud& cloud, const Camera& camera, RenderOptions options,
                   const RenderGradient& weights) {
  options.absgrad = true;
  const CloudGradient gradient = Gradient(cloud, camera, options, weights);
  const CentreGradients expected = Reference(cloud, camera, options, weights);
  ASSERT_EQ(gradient.means2d_abs.size(), expected.absolute.size());
  double largest = 0;
  for (const double g : expected.absolute) largest = std::max(largest, g);
  ASSERT_GT(largest, 0);
  for (size_t i = 0; i < expected.absolute.size(); ++i) {
    const double tolerance = 1e-3 * expected.absolute[i] + 1e-5 * largest;
    EXPECT_NEAR(gradient.means2d_abs[i], expected.absolute[i], tolerance) << i;
    EXPECT_NEAR(gradient.means2d[i], expected.sums[i], tolerance) << i;
    EXPECT_LE(std::abs(gradient.means2d[i]), gradient.means2d_abs[i] + tolerance) << i;
  }
}

TEST(Absgrad, MatchesALoopOverPixels) {
  for (uint64_t seed = 0; seed < 6; ++seed) {
    RenderOptions options;
    options.profile = seed % 2 == 0 ? RasterProfile::kGsplat14 : RasterProfile::kGsplat15;
    options.mode = seed / 2 % 2 == 0 ? RenderMode::kClassic : RenderMode::kAntialiased;
    options.background = {0.3f, static_cast<float>(seed % 3) * 0.5f, 1.0f};
    // More than a batch holds in a tile, opaque ones among them.
    const GaussianCloud cloud =
        RandomCloud(seed, {.gaussians = 600, .degree = static_cast<int>(seed % 4), .largest = 0.5});
    const Camera camera = RandomCamera(seed, 53, 37);
    SCOPED_TRACE(seed);
    ExpectMatches(cloud, camera, options, RandomLoss(seed, cloud, camera, options).weights);
  }
}

TEST(Absgrad, EveryInstructionSetMatches) {
  const GaussianCloud cloud = RandomCloud(9, {.gaussians = 200, .degree = 1, .largest = 0.5});
  const Camera camera = RandomCamera(9, 35, 18);
  const RenderGradient weights = RandomLoss(9, cloud, camera, {}).weights;
  ForEachSimdTarget([&] { ExpectMatches(cloud, camera, {}, weights); });
  SkipWhenOnlyOneSimdTarget();
}

// The case it is for: pixels that pull apart cancel in the one and not in the other.
TEST(Absgrad, PixelsThatPullApartDoNotCancel) {
  const GaussianCloud cloud = OneGaussian(0, 0, 3, 0.6, 0.5);
  const Camera camera = FrontCamera(32, 32, 40);
  RenderGradient weights{Image(32, 32, 3), {}, {0, 0, 32, 32}};
  std::fill(weights.color.pixels.begin(), weights.color.pixels.end(), 1.0f);
  RenderOptions options;
  options.absgrad = true;
  const CloudGradient gradient = Gradient(cloud, camera, options, weights);
  for (size_t a = 0; a < 2; ++a) {
    EXPECT_NEAR(gradient.means2d[a], 0, 1e-3);
    EXPECT_GT(gradient.means2d_abs[a], 1);
  }
}

TEST(Absgrad, NothingElseChangesAndWithoutItThereIsNone) {
  const GaussianCloud cloud = RandomCloud(5, {.gaussians = 300, .degree = 1});
  const Camera camera = RandomCamera(5, 50, 41);
  const RenderGradient weights = RandomLoss(5, cloud, camera, {}).weights;
  const CloudGradient without = Gradient(cloud, camera, {}, weights);
  RenderOptions options;
  options.absgrad = true;
  const CloudGradient with = Gradient(cloud, camera, options, weights);
  EXPECT_TRUE(without.means2d_abs.empty());
  EXPECT_EQ(without.means, with.means);
  EXPECT_EQ(without.log_scales, with.log_scales);
  EXPECT_EQ(without.quats, with.quats);
  EXPECT_EQ(without.opacity_logits, with.opacity_logits);
  EXPECT_EQ(without.sh, with.sh);
  EXPECT_EQ(without.means2d, with.means2d);
  EXPECT_EQ(without.background, with.background);
}

TEST(Absgrad, NeitherThreadsNorRunsOfTilesChangeABit) {
  const GaussianCloud cloud = RandomCloud(70, {.gaussians = 20000, .degree = 0, .smallest = 0.005, .largest = 0.08});
  const Camera camera = RandomCamera(70, 150, 83);
  RenderOptions options;
  options.absgrad = true;
  const RenderGradient weights = RandomLoss(70, cloud, camera, options).weights;
  SetThreadCount(1);
  const CloudGradient one = Gradient(cloud, camera, options, weights);
  for (const int threads : {1, 2, 5}) {
    SetThreadCount(threads);
    for (const int64_t pairs : {kMaxPairs, int64_t{3000}}) {
      options.max_pairs = pairs;
      EXPECT_EQ(Gradient(cloud, camera, options, weights).means2d_abs, one.means2d_abs) << threads << ", " << pairs;
    }
  }
  SetThreadCount(0);
}

TEST(Absgrad, AnEmptyCloudAndAnEmptyBoxHaveNone) {
  GaussianCloud empty;
  empty.Resize(0, 3);
  RenderOptions options;
  options.absgrad = true;
  RenderGradient weights{Image(20, 10, 3), {}, {0, 0, 20, 10}};
  std::fill(weights.color.pixels.begin(), weights.color.pixels.end(), 0.5f);
  EXPECT_TRUE(Gradient(empty, FrontCamera(20, 10, 10), options, weights).means2d_abs.empty());
  weights.box = {};
  const CloudGradient none = Gradient(OneGaussian(0, 0, 3, 0.2, 0.8), FrontCamera(20, 10, 10), options, weights);
  EXPECT_EQ(none.means2d_abs, (Buffer<float>{0, 0}));
}

}  // namespace
}  // namespace anchorsplat
