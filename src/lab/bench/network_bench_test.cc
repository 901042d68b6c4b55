#include "bench/network_bench.h"

#include <gtest/gtest.h>

#include "core/random.h"

namespace anchorsplat {
namespace {

TEST(NetworkBench, CountsWhatTheNetworkDoes) {
  PublishedConfig config;
  config.copies = 2;
  config.encoder_channels = {16};
  config.encoder_blocks = {1};
  config.encoder_heads = {2};
  config.decoder_channels = config.decoder_blocks = config.decoder_heads = {};
  config.strides = {};
  config.head_hidden = 8;
  const auto network = PublishedNetwork::Load(config, HashWeights());
  ASSERT_TRUE(network.ok());

  // Ten Gaussians far from each other: the convolution has its centre only.
  GaussianCloud cloud;
  cloud.Resize(10, 0);
  Random random(1);
  for (auto& v : cloud.means) v = static_cast<float>(random.Uniform(-1, 1));
  for (auto& v : cloud.log_scales) v = -5;
  for (auto& v : cloud.quats) v = 0.5f;
  for (auto& v : cloud.opacity_logits) v = 0;
  for (auto& v : cloud.sh) v = 0;
  const auto report = BenchNetwork(cloud, *network, {.repeats = 2});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->gaussians, 10);
  EXPECT_EQ(report->copies, 2);
  const double block = 16 * 16 * (1 + 1 + 3 + 1 + 4 + 4), attention = 2.0 * 10 * 16;
  const double heads = 6 * (75 * 8 + 8 * 8 + 8 * 8) + 8 * 2 * 59;
  EXPECT_EQ(report->multiply_adds, 10 * (59 * 16 + block + attention + heads));
  EXPECT_GT(report->ratio, 0);
  double sum = 0;
  for (const NetworkBenchStep& step : report->steps) sum += step.seconds;
  EXPECT_NEAR(sum, report->seconds, 1e-9);

  EXPECT_FALSE(BenchNetwork(cloud, *network, {.repeats = 0}).ok());
  EXPECT_FALSE(BenchNetwork(GaussianCloud{}, *network).ok());
}

}  // namespace
}  // namespace anchorsplat
