#include "bench/upscale_bench.h"

#include <gtest/gtest.h>

#include "io/folder_for_test.h"
#include "upscale/small_upscaler_for_test.h"

namespace anchorsplat {
namespace {

TEST(UpscaleBench, Measures) {
  const TestFolder folder;
  ASSERT_TRUE(SpanForTest(4, 2).Write(folder / "network.safetensors").ok());
  auto network = Upscaler::Read(folder / "network.safetensors");
  ASSERT_TRUE(network.ok());
  const auto report = BenchUpscale(*network, {.width = 20, .height = 10, .repeats = 1});
  ASSERT_TRUE(report.ok());
  // conv_1, 19 convolutions 4 to 4, conv_cat and the upsampler.
  EXPECT_EQ(report->multiply_adds, 200.0 * (9 * 4 * 3 + 19 * 9 * 4 * 4 + 4 * 16 + 9 * 12 * 4));
  EXPECT_GT(report->seconds, 0);
  EXPECT_GT(report->gemm_flops, 0);
  EXPECT_GT(report->ratio, 0);
  EXPECT_EQ(BenchUpscale(*network, {.repeats = 0}).error().code, ErrorCode::kBadArgument);
}

}  // namespace
}  // namespace anchorsplat
