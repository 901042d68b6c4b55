#include "render/blend.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/random.h"

namespace anchorsplat {
namespace {

constexpr int kWidth = 35, kHeight = 21, kTilesX = 3, kTilesY = 2;  // the last tiles hang over the edge

struct Lists {
  std::vector<ProjectedGaussian> gaussians;
  std::vector<int64_t> offsets = {0};
  std::vector<int32_t> pairs;
};

// Every tile lists some Gaussians in the order of their rows, one of them none.
Lists RandomLists(uint64_t seed, double opacity) {
  Random random(seed);
  Lists lists;
  for (int i = 0; i < 900; ++i) {
    ProjectedGaussian g{};
    g.x = random.Uniform(-10, 45);
    g.y = random.Uniform(-10, 31);
    g.u_xx = static_cast<float>(std::exp(random.Uniform(-3, 0)));
    g.u_yy = static_cast<float>(std::exp(random.Uniform(-3, 0)));
    g.u_xy = static_cast<float>(random.Uniform(-1, 1) * g.u_xx);
    g.log2_opacity = static_cast<float>(std::log2(opacity * random.Uniform(0.1, 1)));
    for (float& c : g.rgb) c = static_cast<float>(random.Uniform());
    g.depth = static_cast<float>(1 + 0.01 * i);
    lists.gaussians.push_back(g);
  }
  for (int tile = 0; tile < kTilesX * kTilesY; ++tile) {
    for (int32_t i = 0; i < 900; ++i) {
      if (tile != 2 && random.Uniform() < 0.7) lists.pairs.push_back(i);
    }
    lists.offsets.push_back(static_cast<int64_t>(lists.pairs.size()));
  }
  return lists;
}

TEST(Blend, WhatTheBackwardPassNeedsMatchesPlainLoop) {
  for (const double opacity : {0.02, 0.2, 1.0}) {  // never stops, stops late, stops early
    const Lists lists = RandomLists(4, opacity);
    std::vector<float> color(3 * kWidth * kHeight), alpha(kWidth * kHeight), depth(alpha), transmittance(alpha);
    std::vector<int32_t> contributors(alpha.size());
    std::vector<int64_t> evaluations(kTilesX * kTilesY, -1);
    BlendParams p{};
    p.width = kWidth;
    p.height = kHeight;
    p.tiles_x = kTilesX;
    p.projected = lists.gaussians.data();
    p.tile_offsets = lists.offsets.data();
    p.pairs = lists.pairs.data();
    p.first_tile = 0;
    p.last_tile = kTilesX * kTilesY;
    p.background[1] = 0.5f;
    p.color = color.data();
    p.alpha = alpha.data();
    p.depth = depth.data();
    p.transmittance = transmittance.data();
    p.contributors = contributors.data();
    p.evaluations = evaluations.data();
    BlendCpu(p);

    int compared = 0;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const size_t tile = static_cast<size_t>(y / 16 * kTilesX + x / 16);
        double t = 1, green = 0, z = 0, margin = 1;
        int32_t last = 0;
        for (int64_t k = lists.offsets[tile]; k < lists.offsets[tile + 1]; ++k) {
          const ProjectedGaussian& g = lists.gaussians[static_cast<size_t>(lists.pairs[static_cast<size_t>(k)])];
          const double dx = x + 0.5 - g.x, dy = y + 0.5 - g.y;
          const double u = g.u_xx * dx + g.u_xy * dy, v = g.u_yy * dy;
          const double a = std::min(0.999, std::exp2(g.log2_opacity - u * u - v * v));
          margin = std::min(margin, std::abs(a / kMinAlpha - 1));
          if (a < kMinAlpha) continue;
          margin = std::min(margin, std::abs(t * (1 - a) / kMinTransmittance - 1));
          if (t * (1 - a) <= kMinTransmittance) break;
          green += a * t * g.rgb[1];
          z += a * t * g.depth;
          t *= 1 - a;
          last = static_cast<int32_t>(k - lists.offsets[tile]) + 1;
        }
        if (margin < 1e-4) continue;
        ++compared;
        const size_t i = static_cast<size_t>(y * kWidth + x);
        EXPECT_EQ(contributors[i], last);
        EXPECT_NEAR(transmittance[i], t, 1e-6 + 1e-4 * t);
        EXPECT_NEAR(alpha[i], 1 - t, 1e-5);
        EXPECT_NEAR(color[static_cast<size_t>(kWidth * kHeight) + i], green + 0.5 * t, 1e-5);
        EXPECT_NEAR(depth[i], last > 0 ? z / (1 - t) : 0, 2e-5);
      }
    }
    EXPECT_GT(compared, kWidth * kHeight / 2);
    EXPECT_EQ(evaluations[2], 0);
    EXPECT_GT(evaluations[0], 0);
  }
}

TEST(Blend, ExponentialIsGoodToAMillionth) {
  // One Gaussian of red 1, so wide that its α is its opacity everywhere: red is then α itself.
  ProjectedGaussian g{};
  g.u_xx = g.u_yy = 1e-9f;
  g.rgb[0] = 1;
  const std::vector<int64_t> offsets = {0, 1};
  const std::vector<int32_t> pairs = {0};
  std::vector<float> color(3 * 16), alpha(16);
  BlendParams p{};
  p.width = p.height = kBlock;
  p.tiles_x = 1;
  p.projected = &g;
  p.tile_offsets = offsets.data();
  p.pairs = pairs.data();
  p.last_tile = 1;
  p.color = color.data();
  p.alpha = alpha.data();
  double largest = 0;
  for (int step = 0; step < 4000; ++step) {
    g.log2_opacity = -0.01f - 0.00199f * static_cast<float>(step);
    BlendCpu(p);
    const double expected = std::exp2(double{g.log2_opacity});
    for (int i = 0; i < 16; ++i) {
      largest = std::max(largest, std::abs(color[static_cast<size_t>(i)] / expected - 1));
    }
  }
  EXPECT_LT(largest, 1e-6);
}

}  // namespace
}  // namespace anchorsplat
