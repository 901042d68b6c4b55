#include "bench/fit_bench.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"

namespace anchorsplat {
namespace {

GaussianCloud SmallCloud() {
  GaussianCloud cloud;
  cloud.Resize(300, 1);
  Random random(1);
  for (float& x : cloud.means) x = static_cast<float>(random.Uniform(-0.5, 0.5));
  for (float& x : cloud.log_scales) x = static_cast<float>(random.Uniform(-4, -3));
  for (float& x : cloud.quats) x = static_cast<float>(random.Normal());
  for (float& x : cloud.opacity_logits) x = static_cast<float>(random.Normal());
  for (float& x : cloud.sh) x = static_cast<float>(0.3 * random.Normal());
  return cloud;
}

TEST(FitBench, StagesAddUpToTheIteration) {
  const auto rows = BenchFit(SmallCloud(), "small", {.widths = {32, 64}, .poses = 2, .repeats = 2});
  ASSERT_TRUE(rows.ok()) << rows.error().message;
  ASSERT_EQ(rows->size(), 2u);
  for (const FitBenchRow& row : *rows) {
    EXPECT_EQ(row.scene, "small");
    EXPECT_EQ(row.gaussians, 300);
    EXPECT_GT(row.visible, 0);
    EXPECT_GT(row.pairs, 0);
    EXPECT_GT(row.evaluations, 0);
    const double sum = row.project_ms + row.spherical_harmonics_ms + row.sort_ms + row.bin_ms + row.blend_ms +
                       row.loss_ms + row.blend_backward_ms + row.project_backward_ms + row.adam_ms + row.densify_ms;
    EXPECT_GT(row.blend_backward_ms, 0);
    EXPECT_GT(row.adam_ms, 0);
    EXPECT_GE(row.ms, sum * (1 - 1e-9));
  }
  EXPECT_EQ((*rows)[1].width, 64);
}

TEST(FitBench, MeasuresADenseSplat) {
  const auto rows = BenchFit(SmallCloud(), "small", {.widths = {32}, .poses = 1, .repeats = 1, .split = 8});
  ASSERT_TRUE(rows.ok()) << rows.error().message;
  EXPECT_EQ((*rows)[0].scene, "small x8");
  EXPECT_EQ((*rows)[0].gaussians, 2400);
  EXPECT_GT((*rows)[0].visible, 1500);  // they are faint, but there
}

TEST(FitBench, RefusesWhatCannotBeMeasured) {
  GaussianCloud nothing;
  nothing.Resize(0, 0);
  EXPECT_FALSE(BenchFit(nothing, "nothing").ok());
  EXPECT_FALSE(BenchFit(SmallCloud(), "small", {.poses = 0}).ok());
  EXPECT_FALSE(BenchFit(SmallCloud(), "small", {.repeats = 0}).ok());
  EXPECT_FALSE(BenchFit(SmallCloud(), "small", {.radius = -1}).ok());
  EXPECT_FALSE(BenchFit(SmallCloud(), "small", {.split = 0}).ok());
  EXPECT_FALSE(BenchFit(SmallCloud(), "small", {.fov_degrees = 180}).ok());
  EXPECT_FALSE(BenchFit(SmallCloud(), "small", {.widths = {10}}).ok());
}

}  // namespace
}  // namespace anchorsplat
