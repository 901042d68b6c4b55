#include "request/device_flags.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/messages_for_test.h"
#include "gpu/gpu_for_test.h"
#include "request/words.h"

namespace anchorsplat {
namespace {

TEST(DeviceFlags, AreReadAsWords) {
  DeviceFlags flags;
  CLI::App verb;
  flags.AddTo(verb);
  ASSERT_TRUE(ParseWords(verb, {}).ok());
  EXPECT_EQ(flags.device, DeviceChoice{});
  EXPECT_EQ(flags.max_gpu_memory, uint64_t{2} << 30);
  ASSERT_TRUE(ParseWords(verb, {"--device=2", "--max-gpu-memory=1GiB"}).ok());
  EXPECT_EQ(flags.device, (DeviceChoice{DeviceChoice::Kind::kNumber, 2}));
  EXPECT_EQ(flags.max_gpu_memory, uint64_t{1} << 30);
  EXPECT_EQ(ParseWords(verb, {"--device=card"}).error().code, ErrorCode::kBadArgument);
}

TEST(DeviceUse, NamesTheCpu) { EXPECT_EQ(DeviceUse().ToJson(), (nlohmann::json{{"name", "cpu"}})); }

TEST(DeviceUse, SaysWhatTheGpuTookAndWhyItWasGivenUp) {
  const std::shared_ptr<GpuDevice> gpu = GpuForTest();
  ASSERT_NE(gpu, nullptr);
  const Messages messages;
  const RunScope run({.device = DeviceChoice{DeviceChoice::Kind::kGpu}});
  const DeviceUse use;
  const nlohmann::json idle = use.ToJson();
  EXPECT_EQ(idle["name"], gpu->adapter().name);
  EXPECT_EQ(idle["backend"], gpu->adapter().backend);
  EXPECT_EQ(idle["type"], NameOf(gpu->adapter().type));
  EXPECT_EQ(idle["seconds"], 0);
  EXPECT_FALSE(idle.contains("gave_up"));

  const auto memory = gpu->Allocate(1 << 20, "a test");
  ASSERT_TRUE(memory.ok()) << memory.error().message;
  ASSERT_TRUE(gpu->Wait().ok());
  const nlohmann::json busy = use.ToJson();
  EXPECT_GT(busy["seconds"], 0);
  EXPECT_GT(busy["share"], 0);
  EXPECT_LE(busy["share"], 1);

  GiveUpGpu({ErrorCode::kIo, "the device was lost"});
  EXPECT_EQ(use.ToJson()["gave_up"], "the device was lost");
  EXPECT_EQ(use.ToJson()["name"], gpu->adapter().name);
  EXPECT_EQ(DeviceUse().ToJson(), (nlohmann::json{{"name", "cpu"}, {"gave_up", "the device was lost"}}));
}

}  // namespace
}  // namespace anchorsplat
