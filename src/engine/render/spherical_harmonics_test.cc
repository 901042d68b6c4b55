#include "render/spherical_harmonics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/spherical_harmonics.h"
#include "render/project.h"
#include "render/scenes_for_test.h"

namespace anchorsplat {
namespace {

struct Colors {
  std::vector<ProjectedGaussian> gaussians;
  std::vector<TileRect> tiles;
  std::vector<int32_t> visible, counts;
};

// Colours of all Gaussians of the cloud but every seventh, which counts as culled.
Colors Evaluate(const GaussianCloud& cloud, int degree, const std::array<double, 3>& center) {
  const size_t n = static_cast<size_t>(cloud.size());
  Colors out;
  out.gaussians.resize(n);
  out.tiles.assign(n, TileRect{0, 0, 1, 1});
  out.visible.resize(n);
  out.counts.assign(static_cast<size_t>(ProjectChunks(cloud.size())), 0);
  for (size_t i = 0; i < n; ++i) {
    for (float& c : out.gaussians[i].rgb) c = -1;  // "not written"
    if (i % 7 == 6) continue;
    const size_t chunk = i / kProjectChunk;
    out.visible[chunk * kProjectChunk + static_cast<size_t>(out.counts[chunk]++)] = static_cast<int32_t>(i);
  }
  SphericalHarmonicsParams p{};
  p.count = cloud.size();
  p.degree = degree;
  p.stride = cloud.sh_stride();
  p.means = cloud.means.data();
  p.sh = cloud.sh.data();
  p.center = center;
  p.visible = out.visible.data();
  p.visible_counts = out.counts.data();
  p.tiles = out.tiles.data();
  p.projected = out.gaussians.data();
  SphericalHarmonicsCpu(p);
  return out;
}

TEST(SphericalHarmonics, MatchesTheBasisInDouble) {
  const std::array<double, 3> center = {1000.3, -2, 3};
  for (int stored = 0; stored <= 3; ++stored) {
    GaussianCloud cloud = test::RandomCloud(1, {.gaussians = 1100, .degree = stored});
    for (size_t i = 0; i < 1100; ++i) cloud.means[3 * i] += 1000;  // floats are coarse here
    for (int used = 0; used <= stored; ++used) {
      const Colors out = Evaluate(cloud, used, center);
      for (size_t i = 0; i < 1100; ++i) {
        if (i % 7 == 6) {
          EXPECT_EQ(out.gaussians[i].rgb[0], -1);
          continue;
        }
        const double x = cloud.means[3 * i] - center[0], y = cloud.means[3 * i + 1] - center[1],
                     z = cloud.means[3 * i + 2] - center[2];
        const double norm = std::sqrt(x * x + y * y + z * z);
        const auto basis = ShBasis<double>(x / norm, y / norm, z / norm);
        for (size_t c = 0; c < 3; ++c) {
          double expected = 0.5;
          for (size_t k = 0; k < static_cast<size_t>(ShCoefficients(used)); ++k) {
            expected += basis[k] * cloud.sh[i * static_cast<size_t>(cloud.sh_stride()) + 3 * k + c];
          }
          EXPECT_NEAR(out.gaussians[i].rgb[c], std::max(expected, 0.0), 3e-6) << stored << used << " " << i;
        }
      }
    }
  }
}

TEST(SphericalHarmonics, CullsColoursThatAreNotFinite) {
  GaussianCloud cloud = test::RandomCloud(2, {.gaussians = 20, .degree = 3});
  cloud.sh[48 * 3 + 47] = std::nanf("");
  cloud.sh[48 * 5] = INFINITY;
  cloud.sh[48 * 8 + 1] = -INFINITY;
  const Colors out = Evaluate(cloud, 3, {0, 0, 5});
  EXPECT_EQ(out.counts[0], 18 - 3);  // rows 6 and 13 were not listed
  for (const int32_t gone : {3, 5, 8}) {
    EXPECT_EQ(out.tiles[static_cast<size_t>(gone)].x1, 0);
    for (int32_t k = 0; k < out.counts[0]; ++k) EXPECT_NE(out.visible[static_cast<size_t>(k)], gone);
  }
  EXPECT_EQ(out.tiles[4].x1, 1);
}

}  // namespace
}  // namespace anchorsplat
