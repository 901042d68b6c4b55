#include "bench/render_bench.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/random.h"

namespace anchorsplat {
namespace {

GaussianCloud SmallCloud() {
  GaussianCloud cloud;
  cloud.Resize(50, 1);
  Random random(1);
  for (float& x : cloud.means) x = static_cast<float>(random.Uniform(-0.3, 0.3));
  for (float& x : cloud.log_scales) x = static_cast<float>(random.Uniform(-5, -2));
  for (float& x : cloud.quats) x = static_cast<float>(random.Normal());
  for (float& x : cloud.opacity_logits) x = static_cast<float>(random.Uniform(-3, 3));
  for (float& x : cloud.sh) x = static_cast<float>(0.3 * random.Normal());
  return cloud;
}

TEST(RenderBench, ReportsThreeLoadsAsRatiosOfTheMachine) {
  const auto report = BenchRender(SmallCloud(), "small", {.poses = 2, .repeats = 1, .split = 3});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_GT(report->limits.fma_per_second, 0);
  EXPECT_GT(report->limits.bytes_per_second, 0);
  EXPECT_GE(report->limits.threads, 1);
  EXPECT_FALSE(report->limits.instruction_set.empty());
  ASSERT_EQ(report->rows.size(), 3u);
  EXPECT_EQ(report->rows[0].width, 256);
  EXPECT_EQ(report->rows[1].width, 1024);
  EXPECT_EQ(report->rows[2].scene, "small x3");
  EXPECT_EQ(report->rows[2].gaussians, 150);
  for (const RenderBenchRow& row : report->rows) {
    EXPECT_EQ(row.visible, row.gaussians);
    EXPECT_GT(row.evaluations, row.pairs / 2);
    const double stages = row.project_ms + row.spherical_harmonics_ms + row.sort_ms + row.bin_ms + row.blend_ms;
    EXPECT_LE(stages, row.ms);
    EXPECT_GT(row.blend_of_fma_limit, 0);
    EXPECT_GT(row.project_of_memory_limit, 0);
  }
}

TEST(RenderBench, RefusesNothingToDo) {
  EXPECT_FALSE(BenchRender(GaussianCloud{}, "empty").ok());
  EXPECT_FALSE(BenchRender(SmallCloud(), "small", {.poses = 0}).ok());
  EXPECT_FALSE(BenchRender(SmallCloud(), "small", {.radius = -1}).ok());
  EXPECT_FALSE(BenchRender(SmallCloud(), "small", {.repeats = 0}).ok());
  EXPECT_FALSE(BenchRender(SmallCloud(), "small", {.split = 0}).ok());
}

TEST(RenderBench, SplitKeepsPlaceAndVolume) {
  const GaussianCloud cloud = SmallCloud();
  const GaussianCloud split = SplitGaussians(cloud, 1000, 7);
  ASSERT_TRUE(Validate(split).ok());
  ASSERT_EQ(split.size(), 50000);
  for (size_t i = 0; i < 50; ++i) {
    const double largest =
        std::exp(std::max({cloud.log_scales[3 * i], cloud.log_scales[3 * i + 1], cloud.log_scales[3 * i + 2]}));
    for (size_t a = 0; a < 3; ++a) {
      EXPECT_NEAR(split.log_scales[3000 * i + a], cloud.log_scales[3 * i + a] - std::log(10.0), 1e-5);
      double mean = 0;
      for (size_t k = 0; k < 1000; ++k) mean += split.means[3 * (1000 * i + k) + a] / 1000;
      EXPECT_NEAR(mean, cloud.means[3 * i + a], 5 * largest / std::sqrt(1000.0));
    }
    EXPECT_EQ(split.sh[12 * (1000 * i + 999) + 11], cloud.sh[12 * i + 11]);
    EXPECT_EQ(split.quats[4 * (1000 * i + 1)], cloud.quats[4 * i]);
  }
  EXPECT_EQ(SplitGaussians(cloud, 3, 7).means, SplitGaussians(cloud, 3, 7).means);
  EXPECT_NE(SplitGaussians(cloud, 3, 7).means, SplitGaussians(cloud, 3, 8).means);
}

}  // namespace
}  // namespace anchorsplat
