#include "core/device_choice.h"

#include <gtest/gtest.h>

#include "core/run_context.h"

namespace anchorsplat {
namespace {

TEST(DeviceChoice, WordsAndChoicesAreInverse) {
  for (const char* word : {"cpu", "gpu", "auto", "0", "7", "2147483647"}) {
    const Result<DeviceChoice> choice = ParseDeviceChoice(word);
    ASSERT_TRUE(choice.ok()) << word;
    EXPECT_EQ(DeviceWord(*choice), word);
  }
  EXPECT_EQ(ParseDeviceChoice("3").value(), (DeviceChoice{DeviceChoice::Kind::kNumber, 3}));
}

TEST(DeviceChoice, AnythingElseIsRefused) {
  for (const char* word : {"", "GPU", "cuda", "-1", "1.5", "1 ", "2147483648", "gpu0"}) {
    const Result<DeviceChoice> choice = ParseDeviceChoice(word);
    ASSERT_FALSE(choice.ok()) << word;
    EXPECT_EQ(choice.error().code, ErrorCode::kBadArgument);
  }
  EXPECT_EQ(ParseDeviceChoice("cuda").error().message,
            "'cuda' is not cpu, gpu, auto or the number of an adapter; anchorsplat doctor lists them");
}

TEST(DeviceChoice, RunsCarryItAndItsMemory) {
  constexpr DeviceChoice kGpuChoice{DeviceChoice::Kind::kGpu};
  EXPECT_EQ(DeviceChoiceOfRun(), DeviceChoice{});
  EXPECT_EQ(MaxGpuMemoryOfRun(), kDefaultGpuMemory);
  const RunScope run({.device = kGpuChoice, .max_gpu_memory = 1000});
  {
    const RunScope inner({.max_gpu_memory = 500});
    EXPECT_EQ(DeviceChoiceOfRun(), kGpuChoice);
    EXPECT_EQ(MaxGpuMemoryOfRun(), 500u);
    const RunScope innermost({.device = DeviceChoice{}});
    EXPECT_EQ(DeviceChoiceOfRun(), DeviceChoice{});
    EXPECT_EQ(MaxGpuMemoryOfRun(), 500u);
  }
  EXPECT_EQ(MaxGpuMemoryOfRun(), 1000u);
}

}  // namespace
}  // namespace anchorsplat
