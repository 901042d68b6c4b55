#include "bench/gpu_bench.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <string>

#include "bench/gpu_bench_scene.h"
#include "core/run_context.h"
#include "gpu/gpu_for_test.h"

namespace anchorsplat {
namespace {

constexpr DeviceChoice kGpu{DeviceChoice::Kind::kGpu};

GpuBenchOptions Tiny() {
  GpuBenchOptions options = SmallGpuBench();
  options.gaussians = {500};
  options.sizes = {{40, 24}};
  options.repeats = 1;
  options.kernels = true;
  return options;
}

TEST(GpuBench, MeasuresBothAndHowFarTheyAreApart) {
  if (GpuForTest() == nullptr) GTEST_FAIL() << "no device";
  int done = 0;
  const auto report = BenchGpu(kGpu, Tiny(), [&](const GpuBenchRow&) { ++done; });
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_FALSE(report->adapter.name.empty());
  EXPECT_GT(report->round_trip, 0);
  EXPECT_FALSE(report->interrupted);
  ASSERT_EQ(report->rows.size(), 1u);
  EXPECT_EQ(done, 1);
  const GpuBenchRow& row = report->rows[0];
  EXPECT_EQ(row.problem, "");
  EXPECT_EQ(row.no_cpu, "");
  EXPECT_TRUE(row.resident);
  EXPECT_GT(row.first, 0);
  EXPECT_GT(row.upload, 0);
  EXPECT_GT(row.forward, 0);
  EXPECT_GT(row.backward, 0);
  EXPECT_GT(row.picture, row.upload);
  EXPECT_GT(row.waiting, 0);
  EXPECT_LE(row.waiting, 1);
  EXPECT_GT(row.visible, 250);
  EXPECT_GE(row.pairs, row.visible);
  ASSERT_TRUE(row.cpu.has_value());
  EXPECT_GT(row.cpu->forward, 0);
  EXPECT_GT(row.cpu->backward, 0);
  EXPECT_EQ(row.cpu->visible, row.visible);
  EXPECT_EQ(row.cpu->out_of_order, 0);
  EXPECT_EQ(row.cpu->values, 4 * 40 * 24);
  EXPECT_EQ(BrokenPromise(row), "");
  EXPECT_TRUE(std::ranges::any_of(row.cpu->gradient_l2, [](double l2) { return l2 > 0; })) << "compared with itself";
  ASSERT_TRUE(row.views.has_value());
  EXPECT_EQ(row.views->count, 8);
  EXPECT_EQ(row.views->waits, 2);
  EXPECT_EQ(row.views->waits_together, 1.0 / 8);
  EXPECT_EQ(row.views->differing, 0);
  EXPECT_GT(row.views->seconds_together, 0);
  EXPECT_GT(row.kernels.size(), 5u);
  for (const KernelTime& time : row.kernels) {
    EXPECT_FALSE(time.entry.empty());
    EXPECT_GE(time.calls, 1) << time.entry;
    EXPECT_GE(time.seconds, 0) << time.entry;
    EXPECT_EQ(time.unchecked.has_value(), row.no_unchecked.empty()) << time.entry;
  }
}

// A row that does not fit says so, and the next one is measured.
TEST(GpuBench, GoesOnAfterARowThatDoesNotFit) {
  if (GpuForTest() == nullptr) GTEST_FAIL() << "no device";
  const RunScope memory({.max_gpu_memory = uint64_t{24} << 20});
  GpuBenchOptions options = Tiny();
  options.kernels = false;
  options.gaussians = {400'000, 100};
  const auto report = BenchGpu(kGpu, options);
  ASSERT_TRUE(report.ok()) << report.error().message;
  ASSERT_EQ(report->rows.size(), 2u);
  EXPECT_NE(report->rows[0].problem.find("; try --max-gpu-memory 50M"), std::string::npos) << report->rows[0].problem;
  EXPECT_FALSE(report->rows[0].cpu.has_value());
  EXPECT_EQ(report->rows[1].problem, "");
  EXPECT_TRUE(report->rows[1].cpu.has_value());
}

TEST(GpuBench, LeavesOutWhatTakesTheCpuTooLong) {
  if (GpuForTest() == nullptr) GTEST_FAIL() << "no device";
  GpuBenchOptions options = Tiny();
  options.kernels = false;
  options.sizes = {{16, 16}, {40, 24}};
  options.most_cpu_seconds = 0;  // which the first one's are expected to be
  const auto report = BenchGpu(kGpu, options);
  ASSERT_TRUE(report.ok()) << report.error().message;
  ASSERT_EQ(report->rows.size(), 2u);
  EXPECT_TRUE(report->rows[0].cpu.has_value());
  EXPECT_FALSE(report->rows[1].cpu.has_value());
  EXPECT_NE(report->rows[1].no_cpu, "");
  EXPECT_GT(report->rows[1].backward, 0);
}

TEST(GpuBench, StopsAndRefuses) {
  EXPECT_EQ(BenchGpu({}, Tiny()).error().code, ErrorCode::kBadArgument);
  GpuBenchOptions nothing = Tiny();
  nothing.gaussians = {0};
  EXPECT_EQ(BenchGpu(kGpu, nothing).error().code, ErrorCode::kBadArgument);
  if (GpuForTest() == nullptr) GTEST_FAIL() << "no device";
  const std::atomic<bool> stop = true;
  const RunScope run({.stop = &stop});
  const auto report = BenchGpu(kGpu, Tiny());
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_TRUE(report->interrupted);
  EXPECT_TRUE(report->rows.empty());
}

TEST(GpuBench, SaysWhichPromiseIsBroken) {
  GpuBenchRow row;
  EXPECT_EQ(BrokenPromise(row), "");
  row.visible = 100;
  row.cpu = GpuBenchReference{.values = 100'000, .beyond = 5};
  EXPECT_EQ(BrokenPromise(row), "");
  row.cpu->beyond = 6;
  EXPECT_NE(BrokenPromise(row).find("6 of 100,000 values"), std::string::npos);
  row.cpu->beyond = 0;
  row.cpu->gradient_l2[2] = 2e-3;
  EXPECT_NE(BrokenPromise(row).find("quats"), std::string::npos);
  row.cpu->out_of_order = 1;
  EXPECT_NE(BrokenPromise(row).find("order by depth"), std::string::npos);
}

TEST(GpuBenchScene, IsTheSameEverywhereAndAsDenseForEveryCount) {
  const GaussianCloud cloud = GpuBenchCloud(2000, 3);
  ASSERT_TRUE(Validate(cloud).ok());
  EXPECT_EQ(cloud.sh_degree, 3);
  EXPECT_EQ(cloud.means, GpuBenchCloud(2000, 3).means);
  EXPECT_NE(cloud.means, GpuBenchCloud(2000, 4).means);
  double covered[2] = {0, 0};
  for (const int64_t count : {1000, 100'000}) {
    const auto camera = GpuBenchCamera(96, 64);
    ASSERT_TRUE(camera.ok());
    Rasterizer rasterizer;
    RenderOutput output;
    ASSERT_TRUE(rasterizer.Render(GpuBenchCloud(count, 1), *camera, {}, output).ok());
    for (const float alpha : output.alpha.pixels) covered[count > 1000 ? 1 : 0] += alpha / (96.0 * 64.0);
    EXPECT_LT(output.alpha.pixels.front(), 0.1) << "all of it is in the picture";
  }
  EXPECT_GT(covered[0], 0.15);
  EXPECT_NEAR(covered[1], covered[0], 0.1);
}

}  // namespace
}  // namespace anchorsplat
