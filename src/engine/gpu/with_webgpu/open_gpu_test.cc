#include "gpu/open_gpu.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>
#include <string>

#include "gpu/gpu_for_test.h"

namespace anchorsplat {
namespace {

// What a program says that is started with this ANCHORSPLAT_WEBGPU.
void SayProblem(const char* library) {
  setenv("ANCHORSPLAT_WEBGPU", library, 1);
  const Result<std::shared_ptr<GpuDevice>> opened = OpenGpu({DeviceChoice::Kind::kGpu});
  const GpuLibrary found = FindGpuLibrary();
  if (opened.ok() || opened.error().message != found.problem || !found.path.empty() || !ListGpuAdapters().empty()) {
    std::exit(1);
  }
  std::cerr << found.problem;
  std::exit(0);
}

TEST(OpenGpuDeathTest, ANamedLibraryThatIsNoneIsNotReplaced) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");  // a process of its own: a library is looked for once
  EXPECT_EXIT(SayProblem("/nowhere/libwgpu.so"), ::testing::ExitedWithCode(0),
              "ANCHORSPLAT_WEBGPU: the WebGPU library cannot be loaded: /nowhere/libwgpu.so");
  EXPECT_EXIT(SayProblem("libm.so.6"), ::testing::ExitedWithCode(0),
              "ANCHORSPLAT_WEBGPU: libm.so.6 is no WebGPU library: it has no function wgpuCreateInstance");
}

TEST(OpenGpu, AdaptersAreDescribedAlikeEveryTime) {
  const std::shared_ptr<GpuDevice> gpu = GpuForTest();
  ASSERT_NE(gpu, nullptr);
  EXPECT_EQ(FindGpuLibrary().problem, "");
  EXPECT_NE(FindGpuLibrary().path, "");
  const std::vector<GpuAdapter> adapters = ListGpuAdapters(), again = ListGpuAdapters();
  ASSERT_FALSE(adapters.empty());
  ASSERT_EQ(adapters.size(), again.size());
  for (size_t i = 0; i < adapters.size(); ++i) {
    EXPECT_EQ(adapters[i].number, static_cast<int>(i));
    EXPECT_EQ(adapters[i].name, again[i].name);
    EXPECT_NE(adapters[i].name, "");
    if (!adapters[i].unusable.empty()) continue;
    EXPECT_GE(adapters[i].max_binding, uint64_t{128} << 20);
    EXPECT_GE(adapters[i].max_buffer, uint64_t{256} << 20);
    EXPECT_EQ(adapters[i].max_binding % 256, 0u);
    EXPECT_GE(adapters[i].max_storage_buffers, 8u);
    EXPECT_GE(adapters[i].max_workgroup_memory, 16384u);
  }
}

TEST(OpenGpu, ANumberOpensTheSameDevice) {
  const std::shared_ptr<GpuDevice> gpu = GpuForTest();
  ASSERT_NE(gpu, nullptr);
  EXPECT_EQ(OpenGpu({DeviceChoice::Kind::kNumber, gpu->adapter().number}).value(), gpu);
}

}  // namespace
}  // namespace anchorsplat
