#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "core/messages_for_test.h"
#include "core/run_context.h"
#include "gpu/faulty_device_for_test.h"
#include "render/gpu_scene_for_test.h"
#include "render/scenes_for_test.h"

// A device that is small, has no memory or is lost: the picture is right, and one sentence says what happened.
namespace anchorsplat {
namespace {

using test::DrawOnCpu;
using test::RandomCamera;
using test::RandomCloud;
using test::SameBits;
using test::Tally;

constexpr DeviceChoice kGpu{DeviceChoice::Kind::kGpu};
constexpr uint64_t kMebibyte = uint64_t{1} << 20;

// A picture of a run on that device.
struct Drawn {
  RenderOutput output;
  RenderStatistics statistics;
  std::vector<std::string> warnings;
};
Drawn DrawInRun(const std::shared_ptr<GpuDevice>& device, const CloudView& cloud, const Camera& camera,
                const RenderOptions& options, int times = 1) {
  Drawn drawn;
  const Messages messages;
  const RunScope run({.device = kGpu});
  const ScopedGpuForTest scoped(device);
  Rasterizer rasterizer;
  for (int k = 0; k < times; ++k) {
    const Status status = rasterizer.Render(cloud, camera, options, drawn.output);
    EXPECT_TRUE(status.ok()) << status.error().message;
  }
  drawn.statistics = rasterizer.statistics();
  drawn.warnings = messages.warnings();
  return drawn;
}

class GpuFaultsTest : public testing::Test {
 protected:
  void SetUp() override {
    device_ = GpuForTest();
    if (device_ == nullptr) GTEST_FAIL() << "no device";
  }
  std::shared_ptr<FaultyDevice> With(const GpuFaults& faults) {
    return std::make_shared<FaultyDevice>(device_, faults);
  }
  std::shared_ptr<GpuDevice> device_;
};

TEST_F(GpuFaultsTest, ARunOnTheGpuDrawsOnTheGpu) {
  const GaussianCloud cloud = RandomCloud(1);
  const Camera camera = RandomCamera(1, 64, 48);
  RenderStatistics of_cpu;
  const RenderOutput expected = DrawOnCpu(cloud, camera, {}, &of_cpu);
  const auto device = With({});
  const Drawn drawn = DrawInRun(device, cloud, camera, {});
  Tally tally;
  tally.Add(expected, drawn.output);
  tally.ExpectEqual();
  EXPECT_GT(device->calls(), 20);
  EXPECT_TRUE(drawn.warnings.empty());
  EXPECT_EQ(drawn.statistics.visible, of_cpu.visible);
  EXPECT_NEAR(static_cast<double>(drawn.statistics.pairs), static_cast<double>(of_cpu.pairs), 5);
  EXPECT_EQ(drawn.statistics.runs, 1);
  EXPECT_EQ(drawn.statistics.evaluations, 0);
  EXPECT_GT(drawn.statistics.blend, 0);
}

TEST_F(GpuFaultsTest, ALostDeviceIsFollowedByTheCpu) {
  const GaussianCloud cloud = RandomCloud(2);
  const Camera camera = RandomCamera(2, 64, 48);
  const RenderOutput expected = DrawOnCpu(cloud, camera, {});
  const auto healthy = With({});
  DrawInRun(healthy, cloud, camera, {});
  const int calls = healthy->calls();
  for (const int lost_at : {0, 1, calls / 3, calls / 2, calls - 1, calls + 5}) {
    // Twice: of a picture that worked nothing is lost, and the second one says no more.
    const Drawn drawn = DrawInRun(With({.calls = lost_at}), cloud, camera, {}, 2);
    EXPECT_TRUE(SameBits(drawn.output, expected)) << lost_at;
    ASSERT_EQ(drawn.warnings.size(), 1u) << lost_at;
    EXPECT_NE(drawn.warnings[0].find("lost"), std::string::npos) << drawn.warnings[0];
  }
}

TEST_F(GpuFaultsTest, AnyAllocationMayFail) {
  const GaussianCloud cloud = RandomCloud(3, {.gaussians = 1000});
  const Camera camera = RandomCamera(3, 64, 64);
  const RenderOutput expected = DrawOnCpu(cloud, camera, {});
  const auto healthy = With({});
  DrawInRun(healthy, cloud, camera, {});
  Tally tally;
  for (int k = 0; k < healthy->allocations(); ++k) {
    const Drawn drawn = DrawInRun(With({.allocations = k}), cloud, camera, {}, 2);
    tally.Add(expected, drawn.output);
    EXPECT_LE(drawn.warnings.size(), 1u) << k;
  }
  tally.ExpectEqual();
}

TEST_F(GpuFaultsTest, ALimitOfOneMebibytePerBinding) {
  RenderOptions options;
  options.depth = true;
  options.background = {0.5f, 0.25f, 0.125f};
  // The harmonics take three blocks, the picture several bands.
  const GaussianCloud cloud = RandomCloud(4, {.gaussians = 12000, .largest = 0.05});
  const Camera camera = RandomCamera(4, 300, 260);
  const auto device = With({.max_binding = kMebibyte});
  const Drawn drawn = DrawInRun(device, cloud, camera, options);
  EXPECT_TRUE(drawn.warnings.empty()) << drawn.warnings[0];
  EXPECT_GT(drawn.statistics.runs, 1);
  Tally tally;
  tally.Add(DrawOnCpu(cloud, camera, options), drawn.output);
  tally.ExpectEqual();
  // What does not fit at all.
  const GaussianCloud many = RandomCloud(5, {.gaussians = 20000, .degree = 0, .largest = 0.05});
  const Camera small = RandomCamera(5, 40, 30);
  const Drawn refused = DrawInRun(device, many, small, {});
  EXPECT_TRUE(SameBits(refused.output, DrawOnCpu(many, small, {})));
  ASSERT_EQ(refused.warnings.size(), 1u);
}

TEST_F(GpuFaultsTest, AStreamedCloudDrawsTheSameBits) {
  const GaussianCloud cloud = RandomCloud(6, {.gaussians = 5000, .largest = 0.1});
  const Camera camera = RandomCamera(6, 64, 64);
  GpuRasterizer gpu(device_);
  const RenderOutput expected = test::DrawOnGpu(gpu, cloud, camera, {});
  GpuCloud streamed;
  ASSERT_TRUE(streamed.Assign(*device_, cloud).ok());
  ASSERT_TRUE(streamed.can_stream());
  ASSERT_TRUE(streamed.Stream(*device_).ok());
  EXPECT_GT(streamed.block_count(), 5u);
  RenderOutput output = test::PictureFor(camera, false);
  const Result<bool> drawn = gpu.Draw(streamed, camera, kNear, {}, &output);
  ASSERT_TRUE(drawn.ok() && *drawn);
  EXPECT_TRUE(SameBits(output, expected));
}

// The splat takes 12 MiB, all else about 6.
TEST_F(GpuFaultsTest, LittleMemoryStreamsTheCloud) {
  const GaussianCloud cloud = RandomCloud(7, {.gaussians = 50000, .smallest = 0.001, .largest = 0.01});
  const Camera camera = RandomCamera(7, 64, 64);
  const RenderOutput expected = DrawOnCpu(cloud, camera, {});
  for (const uint64_t limit : {uint64_t{14}, uint64_t{9}, uint64_t{3}}) {
    const RunScope run({.max_gpu_memory = limit * kMebibyte});
    const Drawn drawn = DrawInRun(device_, cloud, camera, {}, 2);
    Tally tally;
    tally.Add(expected, drawn.output);
    tally.ExpectEqual();
    EXPECT_EQ(drawn.warnings.size(), limit == 3 ? 1u : 0u) << limit;
  }
}

}  // namespace
}  // namespace anchorsplat
