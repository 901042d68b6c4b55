#include "render/project.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "render/rasterizer_reference.h"
#include "render/scenes_for_test.h"

namespace anchorsplat {
namespace {

struct Projected {
  std::vector<ProjectedGaussian> gaussians;
  std::vector<TileRect> tiles;
  std::vector<int32_t> radii, visible;
};

Projected Project(const GaussianCloud& cloud, const Camera& camera, const RenderOptions& options) {
  const size_t n = static_cast<size_t>(cloud.size());
  Projected out;
  out.gaussians.resize(n);
  out.tiles.resize(n);
  out.radii.resize(2 * n);
  std::vector<int32_t> listed(n), counts(static_cast<size_t>(ProjectChunks(cloud.size())));
  ProjectParams p{};
  p.count = cloud.size();
  p.means = cloud.means.data();
  p.log_scales = cloud.log_scales.data();
  p.quats = cloud.quats.data();
  p.opacity_logits = cloud.opacity_logits.data();
  p.intrinsics = camera.intrinsics;
  p.world_to_camera = camera.world_to_camera;
  p.profile = options.profile;
  p.mode = options.mode;
  p.dilation = DilationOf(options);
  p.projected = out.gaussians.data();
  p.tiles = out.tiles.data();
  p.radii = out.radii.data();
  p.visible = listed.data();
  p.visible_counts = counts.data();
  ProjectCpu(p);
  for (size_t chunk = 0; chunk < counts.size(); ++chunk) {
    const auto first = listed.begin() + static_cast<ptrdiff_t>(chunk) * kProjectChunk;
    out.visible.insert(out.visible.end(), first, first + counts[chunk]);
  }
  return out;
}

TEST(Project, MatchesReference) {
  for (uint64_t seed = 0; seed < 12; ++seed) {
    SCOPED_TRACE(seed);
    RenderOptions options;
    options.profile = seed % 2 == 0 ? RasterProfile::kGsplat14 : RasterProfile::kGsplat15;
    options.mode = kRenderModes[seed / 2 % 3];
    // More than one chunk, and a last register that is not full.
    const GaussianCloud cloud = test::RandomCloud(seed, {.gaussians = 1237, .degree = 0});
    const Camera camera = test::RandomCamera(seed, 211, 97);
    const Projected out = Project(cloud, camera, options);
    std::vector<int32_t> expected_visible;
    int with_radius = 0;
    for (int64_t i = 0; i < cloud.size(); ++i) {
      const size_t row = static_cast<size_t>(i);
      const TileRect tiles = out.tiles[row];
      reference::Splat expected{};
      if (!reference::Project(cloud, i, camera, options, expected)) {
        EXPECT_EQ(out.radii[2 * row], 0);
        EXPECT_EQ(tiles.x1, 0);
        continue;
      }
      ++with_radius;
      EXPECT_EQ(out.radii[2 * row], static_cast<int32_t>(expected.radius_x));
      EXPECT_EQ(out.radii[2 * row + 1], static_cast<int32_t>(expected.radius_y));
      if (tiles.x1 == 0) continue;  // too faint to be seen, or between pixels
      expected_visible.push_back(static_cast<int32_t>(i));
      EXPECT_GE(tiles.x0, expected.tile_x0);
      EXPECT_GE(tiles.y0, expected.tile_y0);
      EXPECT_LE(tiles.x1, expected.tile_x1);
      EXPECT_LE(tiles.y1, expected.tile_y1);
      const ProjectedGaussian& g = out.gaussians[row];
      EXPECT_NEAR(g.x, expected.x, 1e-9);
      EXPECT_NEAR(g.y, expected.y, 1e-9);
      EXPECT_EQ(g.depth, expected.depth);
      EXPECT_NEAR(std::exp2(g.log2_opacity), expected.opacity, 1e-6);
      // The conic from its factor, which carries ½·log2 e. It is calculated in float.
      const double scale = 2 / std::log2(std::exp(1.0));
      const double a = scale * g.u_xx * g.u_xx, b = scale * g.u_xx * g.u_xy,
                   c = scale * (double{g.u_xy} * g.u_xy + double{g.u_yy} * g.u_yy);
      EXPECT_NEAR(a, expected.a, 5e-6 * expected.a);
      EXPECT_NEAR(b, expected.b, 5e-6 * std::sqrt(expected.a * expected.c));
      EXPECT_NEAR(c, expected.c, 5e-6 * expected.c);
    }
    EXPECT_EQ(out.visible, expected_visible);
    EXPECT_GT(with_radius, 600);
    EXPECT_LT(with_radius, 1237);
    EXPECT_GT(expected_visible.size(), 500u);
  }
}

// What floats cannot square, one by one among Gaussians that they can.
TEST(Project, ExtremesMatchReference) {
  for (const RenderMode mode : kRenderModes) {
    RenderOptions options;
    options.mode = mode;
    GaussianCloud cloud = test::RandomCloud(3, {.gaussians = 200, .degree = 0});
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    for (size_t i = 0; i < 200; ++i) {
      for (size_t a = 0; a < 3; ++a) cloud.means[3 * i + a] *= 0.2f;
      float *scales = &cloud.log_scales[3 * i], *q = &cloud.quats[4 * i];
      cloud.opacity_logits[i] = 2;
      switch (i % 8) {
        case 1:  // a needle of 100,000 px
          scales[0] = 8;
          break;
        case 2:  // enormous
          std::fill_n(scales, 3, 43.0f);
          break;
        case 3:  // a point
          std::fill_n(scales, 3, -60.0f);
          break;
        case 4:  // the zero quaternion
          std::fill_n(q, 4, 0.0f);
          break;
        case 5:  // short ones
          std::for_each(q, q + 4, [](float& x) { x *= 1e-25f; });
          break;
        case 6:  // long ones
          std::for_each(q, q + 4, [](float& x) { x *= 1e25f; });
          break;
        case 7:  // flat
          scales[1] = -kInfinity;
          break;
        default:
          break;
      }
    }
    const Camera camera = test::RandomCamera(3, 211, 97);
    const Projected out = Project(cloud, camera, options);
    int compared = 0;
    for (const int32_t i : out.visible) {
      const auto row = static_cast<size_t>(i);
      SCOPED_TRACE(i);
      reference::Splat expected{};
      ASSERT_TRUE(reference::Project(cloud, i, camera, options, expected));
      const ProjectedGaussian& g = out.gaussians[row];
      const double scale = 2 / std::log2(std::exp(1.0));
      const double a = scale * g.u_xx * g.u_xx, c = scale * (double{g.u_xy} * g.u_xy + double{g.u_yy} * g.u_yy);
      // The reference takes a needle's determinant as a difference: its own digits are few there.
      const double digits = i % 8 == 1 ? 1e-4 : 1e-5;
      EXPECT_NEAR(a, expected.a, digits * expected.a);
      EXPECT_NEAR(c, expected.c, digits * expected.c);
      EXPECT_NEAR(std::exp2(g.log2_opacity), expected.opacity, 1e-5);
      ++compared;
    }
    EXPECT_GT(compared, 100);
  }
}

TEST(Project, TilesHoldEveryPixelThatIsSeen) {
  const RenderOptions options;
  const GaussianCloud cloud = test::RandomCloud(77, {.gaussians = 300, .degree = 0});
  const Camera camera = test::RandomCamera(77, 83, 61);
  const Projected out = Project(cloud, camera, options);
  int64_t seen = 0;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    reference::Splat g{};
    if (!reference::Project(cloud, i, camera, options, g)) continue;
    const TileRect tiles = out.tiles[static_cast<size_t>(i)];
    for (int y = 0; y < 61; ++y) {
      for (int x = 0; x < 83; ++x) {
        const int tx = x / 16, ty = y / 16;
        if (tx < g.tile_x0 || tx >= g.tile_x1 || ty < g.tile_y0 || ty >= g.tile_y1) continue;
        const double dx = g.x - x - 0.5, dy = g.y - y - 0.5;
        if (g.opacity * std::exp(-0.5 * (g.a * dx * dx + g.c * dy * dy) - g.b * dx * dy) < kMinAlpha) continue;
        ++seen;
        EXPECT_TRUE(tx >= tiles.x0 && tx < tiles.x1 && ty >= tiles.y0 && ty < tiles.y1) << i << ": " << x << "," << y;
      }
    }
  }
  EXPECT_GT(seen, 10000);
}

TEST(Project, RadiusByHand) {
  // 5 px and 0.3 px² of dilation: largest eigenvalue 25.3 + sqrt(0.01) by gsplat's floor, 3·sqrt(25.4) = 15.1.
  const GaussianCloud cloud = test::OneGaussian(0, 0, 2, 0.1, 0.5);
  const Camera camera = test::FrontCamera(64, 64, 100);
  EXPECT_EQ(Project(cloud, camera, {}).radii, (std::vector<int32_t>{16, 16}));
  // sqrt(2 ln(127.5)) = 3.114 σ of 5.03 px = 15.66.
  EXPECT_EQ(Project(cloud, camera, {.profile = RasterProfile::kGsplat15}).radii, (std::vector<int32_t>{16, 16}));
  // Opacity 0.01: 1.37 σ = 6.9 px in the newer profile, the same 3 σ in the older one.
  const GaussianCloud faint = test::OneGaussian(0, 0, 2, 0.1, 0.01);
  EXPECT_EQ(Project(faint, camera, {}).radii, (std::vector<int32_t>{16, 16}));
  EXPECT_EQ(Project(faint, camera, {.profile = RasterProfile::kGsplat15}).radii, (std::vector<int32_t>{7, 7}));
}

}  // namespace
}  // namespace anchorsplat
