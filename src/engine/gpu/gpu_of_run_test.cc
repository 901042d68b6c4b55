#include "gpu/gpu_of_run.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "core/messages_for_test.h"
#include "core/run_context.h"
#include "gpu/faulty_device_for_test.h"
#include "gpu/gpu_for_test.h"

namespace anchorsplat {
namespace {

constexpr DeviceChoice kCpuChoice{};
constexpr DeviceChoice kGpuChoice{DeviceChoice::Kind::kGpu};

TEST(GpuOfRun, IsNoneWhereNobodyAsks) {
  const Result<std::shared_ptr<GpuDevice>> gpu = GpuOfRun();
  ASSERT_TRUE(gpu.ok());
  EXPECT_EQ(*gpu, nullptr);
}

TEST(GpuOfRun, IsTheOneThatEverybodyShares) {
  const std::shared_ptr<GpuDevice> expected = GpuForTest();
  ASSERT_NE(expected, nullptr);
  const RunScope run({.device = kGpuChoice});
  EXPECT_EQ(GpuOfRun().value(), expected);
  const RunScope inner({.device = kCpuChoice});
  EXPECT_EQ(GpuOfRun().value(), nullptr);
}

TEST(GpuOfRun, AutoTakesNoAdapterOfTypeCpu) {
  const RunScope run({.device = DeviceChoice{DeviceChoice::Kind::kAuto}});
  const Result<std::shared_ptr<GpuDevice>> gpu = GpuOfRun();
  ASSERT_TRUE(gpu.ok()) << gpu.error().message;
  EXPECT_TRUE(*gpu == nullptr || (*gpu)->adapter().type != GpuAdapter::Type::kCpu);
}

TEST(GpuOfRun, ANumberThatIsNotThereIsAnError) {
  const RunScope run({.device = DeviceChoice{DeviceChoice::Kind::kNumber, 99}});
  const Result<std::shared_ptr<GpuDevice>> gpu = GpuOfRun();
  ASSERT_FALSE(gpu.ok());
  EXPECT_EQ(gpu.error().code, ErrorCode::kNotFound);
  EXPECT_NE(gpu.error().message.find("there is no device 99"), std::string::npos) << gpu.error().message;
}

TEST(GpuOfRun, GivingUpIsSaidOnceAndEndsWithTheRun) {
  const std::shared_ptr<GpuDevice> expected = GpuForTest();
  ASSERT_NE(expected, nullptr);
  {
    const Messages messages;
    const RunScope run({.device = kGpuChoice});
    EXPECT_EQ(WhyGpuWasGivenUp(), "");
    GiveUpGpu({ErrorCode::kIo, "the device was lost"});
    GiveUpGpu({ErrorCode::kIo, "the device was lost again"});
    EXPECT_EQ(messages.warnings(),
              std::vector<std::string>{"Continuing on the CPU, as the GPU failed: the device was lost"});
    EXPECT_EQ(WhyGpuWasGivenUp(), "the device was lost");
    EXPECT_EQ(GpuOfRun().value(), nullptr);
  }
  const RunScope next({.device = kGpuChoice});
  EXPECT_EQ(GpuOfRun().value(), expected);
}

TEST(GpuOfRun, TestsPutTheirOwnInItsPlace) {
  const std::shared_ptr<GpuDevice> whole = GpuForTest();
  ASSERT_NE(whole, nullptr);
  const Messages messages;
  const RunScope run({.device = kGpuChoice});
  {
    const auto faulty = std::make_shared<FaultyDevice>(whole, GpuFaults{.max_binding = 1 << 20});
    const ScopedGpuForTest scope(faulty);
    ASSERT_EQ(GpuOfRun().value(), faulty);
    EXPECT_EQ(GpuOfRun().value()->adapter().max_binding, uint64_t{1} << 20);
    GiveUpGpu({ErrorCode::kIo, "a test wants it"});
    EXPECT_EQ(GpuOfRun().value(), nullptr);
  }
  EXPECT_EQ(GpuOfRun().value(), whole);
}

TEST(FaultyDevice, LosesItselfAndRunsOutOfMemory) {
  const std::shared_ptr<GpuDevice> whole = GpuForTest();
  ASSERT_NE(whole, nullptr);
  FaultyDevice gpu(whole, {.calls = 2, .allocations = 1});
  const Result<GpuMemory> buffer = gpu.Allocate(256, "a test");
  ASSERT_TRUE(buffer.ok());
  const Result<GpuMemory> more = gpu.Allocate(256, "a test");
  ASSERT_FALSE(more.ok());
  EXPECT_EQ(more.error().message, "the GPU has no memory left (a test says so)");
  gpu.Clear(**buffer, 0, 256);
  gpu.Clear(**buffer, 0, 256);
  EXPECT_TRUE(gpu.Wait().ok());
  gpu.Clear(**buffer, 0, 256);
  ASSERT_FALSE(gpu.Wait().ok());
  EXPECT_EQ(gpu.Wait().error().message, "the device was lost (a test says so)");
  EXPECT_TRUE(whole->Wait().ok());
}

}  // namespace
}  // namespace anchorsplat
