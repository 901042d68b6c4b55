#include "render/constant_cloud.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "core/messages_for_test.h"
#include "core/run_context.h"
#include "gpu/faulty_device_for_test.h"
#include "render/gpu_scene_for_test.h"
#include "render/scenes_for_test.h"

namespace anchorsplat {
namespace {

using test::RandomCamera;
using test::RandomCloud;
using test::SameBits;
using test::Tally;

constexpr DeviceChoice kGpu{DeviceChoice::Kind::kGpu};

std::vector<Camera> SomeCameras(int count) {
  std::vector<Camera> cameras;
  for (int k = 0; k < count; ++k) cameras.push_back(RandomCamera(static_cast<uint64_t>(k), 40 + 7 * (k % 4), 33));
  return cameras;
}

std::vector<RenderOutput> DrawOneByOne(const CloudView& cloud, const std::vector<Camera>& cameras,
                                       const RenderOptions& options) {
  Rasterizer rasterizer;
  std::vector<RenderOutput> outputs(cameras.size());
  for (size_t k = 0; k < cameras.size(); ++k) {
    const Status status = rasterizer.Render(cloud, cameras[k], options, outputs[k]);
    EXPECT_TRUE(status.ok()) << status.error().message;
  }
  return outputs;
}

std::vector<RenderOutput> DrawEach(const CloudView& cloud, const std::vector<Camera>& cameras,
                                   const RenderOptions& options) {
  ConstantCloud still(cloud);
  Rasterizer rasterizer;
  std::vector<RenderOutput> outputs;
  const Status status = rasterizer.RenderEach(still, cameras, options, [&](size_t k, RenderOutput& output) -> Status {
    EXPECT_EQ(k, outputs.size());
    EXPECT_EQ(output.color.width, cameras[k].intrinsics.width);
    outputs.push_back(std::move(output));
    return {};
  });
  EXPECT_TRUE(status.ok()) << status.error().message;
  return outputs;
}

void ExpectSameBits(const std::vector<RenderOutput>& some, const std::vector<RenderOutput>& others) {
  ASSERT_EQ(some.size(), others.size());
  for (size_t k = 0; k < some.size(); ++k) EXPECT_TRUE(SameBits(some[k], others[k])) << k;
}

TEST(ConstantCloudTest, OnTheCpuEachPictureIsAsByItself) {
  const GaussianCloud cloud = RandomCloud(5, {.gaussians = 200});
  RenderOptions options;
  options.depth = true;
  const std::vector<Camera> cameras = SomeCameras(4);
  ExpectSameBits(DrawEach(cloud, cameras, options), DrawOneByOne(cloud, cameras, options));
}

TEST(ConstantCloudTest, AnErrorIsThatOfItsPicture) {
  const GaussianCloud cloud = RandomCloud(5, {.gaussians = 50});
  ConstantCloud still(cloud);
  std::vector<Camera> cameras = SomeCameras(4);
  cameras[2].intrinsics.fx = -1;
  Rasterizer rasterizer;
  size_t used = 0;
  const auto use = [&](size_t, RenderOutput&) -> Status {
    ++used;
    return {};
  };
  EXPECT_FALSE(rasterizer.RenderEach(still, cameras, {}, use).ok());
  EXPECT_EQ(used, 2u);
  const auto refuse = [](size_t, RenderOutput&) -> Status { return Error{ErrorCode::kIo, "the disk is full"}; };
  EXPECT_EQ(rasterizer.RenderEach(still, cameras, {}, refuse).error().message, "the disk is full");
}

class GpuConstantCloudTest : public testing::Test {
 protected:
  void SetUp() override {
    device_ = GpuForTest();
    if (device_ == nullptr) GTEST_FAIL() << "no device";
  }
  std::shared_ptr<FaultyDevice> With(const GpuFaults& faults) const {
    return std::make_shared<FaultyDevice>(device_, faults);
  }
  std::shared_ptr<GpuDevice> device_;
};

TEST_F(GpuConstantCloudTest, IsUploadedOnce) {
  const RunScope run({.device = kGpu});
  const auto device = With({});
  const ScopedGpuForTest scoped(device);
  const GaussianCloud cloud = RandomCloud(1, {.gaussians = 1000});
  const auto all = static_cast<int64_t>(sizeof(float) * (cloud.means.size() + cloud.sh.size()));
  ConstantCloud still(cloud);
  Rasterizer rasterizer;
  RenderOutput output;
  RenderOptions options;
  options.gradient = true;
  ASSERT_TRUE(rasterizer.Render(still, RandomCamera(1, 64, 48), options, output).ok());
  const int64_t first = device->bytes_written();
  EXPECT_GT(first, all);
  ASSERT_TRUE(rasterizer.Render(still, RandomCamera(2, 64, 48), options, output).ok());
  RenderGradient weights;
  weights.color = output.color;
  weights.box = {0, 0, 64, 48};
  CloudGradient gradient;
  ASSERT_TRUE(rasterizer.Backward(still, weights, gradient).ok());
  EXPECT_LT(device->bytes_written() - first, all);
  // Arrays are uploaded for every picture, and a gradient of the still one does not stand in for theirs.
  CloudGradient of_arrays;
  ASSERT_TRUE(rasterizer.Render(cloud, RandomCamera(2, 64, 48), options, output).ok());
  EXPECT_GT(device->bytes_written() - first, all);
  ASSERT_TRUE(rasterizer.Backward(cloud, weights, of_arrays).ok());
  EXPECT_EQ(gradient.means, of_arrays.means);
  EXPECT_EQ(gradient.sh, of_arrays.sh);
}

TEST_F(GpuConstantCloudTest, PicturesTogetherHaveTheirBits) {
  const RunScope run({.device = kGpu});
  const ScopedGpuForTest scoped(device_);
  for (const bool depth : {false, true}) {
    RenderOptions options;
    options.depth = depth;
    options.background = {0.2f, 0.4f, 0.6f};
    const GaussianCloud cloud = RandomCloud(7, {.gaussians = 600});
    const std::vector<Camera> cameras = SomeCameras(9);
    const int64_t before = device_->waits();
    const auto one_by_one = DrawOneByOne(cloud, cameras, options);
    const int64_t between = device_->waits();
    ExpectSameBits(DrawEach(cloud, cameras, options), one_by_one);
    // Two for the first picture, one for the others.
    EXPECT_EQ(between - before, 18);
    EXPECT_LE(device_->waits() - between, 3);
  }
  const GaussianCloud nothing = RandomCloud(7, {.gaussians = 0});
  ExpectSameBits(DrawEach(nothing, SomeCameras(3), {}), DrawOneByOne(nothing, SomeCameras(3), {}));
}

TEST_F(GpuConstantCloudTest, WhatIsMoreThanExpectedIsDrawnByItself) {
  const RunScope run({.device = kGpu});
  const ScopedGpuForTest scoped(device_);
  const GaussianCloud cloud = RandomCloud(8, {.gaussians = 6000});
  // The first one sees few tiles of it, the others fill theirs.
  std::vector<Camera> cameras = SomeCameras(5);
  for (size_t k = 1; k < cameras.size(); k += 2) {
    Pinhole& intrinsics = cameras[k].intrinsics;
    intrinsics.width = 256, intrinsics.height = 240;
    intrinsics.fx = intrinsics.fy = 900, intrinsics.cx = 128, intrinsics.cy = 120;
  }
  RenderStatistics statistics;
  test::DrawOnCpu(cloud, cameras[1], {}, &statistics);
  ASSERT_GT(statistics.pairs, int64_t{1} << 16);  // of which there is always room
  ExpectSameBits(DrawEach(cloud, cameras, {}), DrawOneByOne(cloud, cameras, {}));
  // One that only the CPU can project, among those that the GPU can.
  GaussianCloud unusual = RandomCloud(9, {.gaussians = 100});
  for (size_t k = 0; k < 3; ++k) unusual.log_scales[k] = 30;
  ExpectSameBits(DrawEach(unusual, SomeCameras(4), {}), DrawOneByOne(unusual, SomeCameras(4), {}));
  RenderOptions few;
  few.max_pairs = 500;
  ExpectSameBits(DrawEach(cloud, SomeCameras(3), few), DrawOneByOne(cloud, SomeCameras(3), few));
}

TEST_F(GpuConstantCloudTest, WhateverFailsThePicturesAreThere) {
  const GaussianCloud cloud = RandomCloud(3, {.gaussians = 300});
  const std::vector<Camera> cameras = SomeCameras(4);
  const auto expected = DrawOneByOne(cloud, cameras, {});
  const auto draw_on = [&](const std::shared_ptr<FaultyDevice>& device) {
    const RunScope run({.device = kGpu});
    const ScopedGpuForTest scoped(device);
    const Messages messages;
    const auto drawn = DrawEach(cloud, cameras, {});
    EXPECT_LE(messages.warnings().size(), 1u);
    return drawn;
  };
  const auto healthy = With({});
  draw_on(healthy);
  Tally tally;
  const auto compare = [&](const std::vector<RenderOutput>& drawn) {
    ASSERT_EQ(drawn.size(), expected.size());
    for (size_t k = 0; k < drawn.size(); ++k) tally.Add(expected[k], drawn[k]);
  };
  for (int k = 0; k < healthy->allocations(); ++k) compare(draw_on(With({.allocations = k})));
  for (int calls = 0; calls < healthy->calls(); calls += 23) compare(draw_on(With({.calls = calls})));
  tally.ExpectEqual();
}

TEST_F(GpuConstantCloudTest, GoesWithTheRunFromDeviceToDevice) {
  const GaussianCloud cloud = RandomCloud(4, {.gaussians = 100});
  const Camera camera = RandomCamera(4, 48, 48);
  ConstantCloud still(cloud);
  Rasterizer rasterizer;
  RenderOutput on_gpu, on_cpu, again;
  {
    const RunScope run({.device = kGpu});
    const ScopedGpuForTest scoped(With({}));
    ASSERT_TRUE(rasterizer.Render(still, camera, {}, on_gpu).ok());
  }
  ASSERT_TRUE(rasterizer.Render(still, camera, {}, on_cpu).ok());
  EXPECT_TRUE(SameBits(on_cpu, test::DrawOnCpu(cloud, camera, {})));
  const RunScope run({.device = kGpu});
  const ScopedGpuForTest scoped(With({}));
  ASSERT_TRUE(rasterizer.Render(still, camera, {}, again).ok());
  EXPECT_TRUE(SameBits(again, on_gpu));
}

}  // namespace
}  // namespace anchorsplat
