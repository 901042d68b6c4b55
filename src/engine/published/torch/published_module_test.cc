#include "published/torch/published_module.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "published/golden_run_for_test.h"
#include "published/published_network.h"

namespace anchorsplat {
namespace {

// Small tensors: waking threads would cost more than the work.
const bool kOneThread = [] {
  torch::set_num_threads(1);
  return true;
}();

torch::Tensor Table(const Buffer<float>& values) {
  return torch::from_blob(const_cast<float*>(values.data()),
                          {static_cast<int64_t>(values.size()) / kFeatures, kFeatures}, torch::kFloat32);
}

AnchorSplatNetwork HashNetwork(const PublishedConfig& config) {
  AnchorSplatNetwork network(config);
  EXPECT_TRUE(SetWeights(*network, HashWeights()).ok());
  network->eval();
  return network;
}

// Narrow and shallow, but with everything in it; strides that leave several points per cluster.
PublishedConfig SmallConfig() {
  PublishedConfig config;
  config.copies = 2;
  config.encoder_channels = {8, 12, 16};
  config.encoder_blocks = {1, 1, 2};
  config.encoder_heads = {2, 4, 8};
  config.decoder_channels = {8, 12};
  config.decoder_blocks = {2, 1};
  config.decoder_heads = {4, 4};
  config.strides = {1, 2};
  config.head_hidden = 16;
  config.patch_size = 32;
  return config;
}

struct SmallCloud {
  torch::Tensor features;
  Hierarchy hierarchy;

  explicit SmallCloud(const PublishedConfig& config, int64_t count = 75) {
    torch::manual_seed(1);
    features = torch::randn({count, kFeatures}) * 0.5;
    features.narrow(1, 0, 3).uniform_(0.1, 0.13);  // about 11³ voxels: some are shared
    hierarchy = ToTensors(
        *BuildHierarchy(GridVoxels(features.data_ptr<float>(), count, kFeatures), HierarchyOptionsFor(config)),
        config.patch_size);
  }
};

TEST(Modules, MatchThePublishedNetworkStageByStage) {
  const GoldenRun golden;
  AnchorSplatNetwork network = HashNetwork(golden.config);
  for (const auto& [name, values] : golden.manifest["weight_checks"].items()) {
    std::map<std::string, torch::Tensor> state;
    for (auto& [key, tensor] : network->StateDict()) state[key] = tensor;
    ASSERT_TRUE(state.contains(name)) << name;
    for (size_t i = 0; i < values.size(); ++i) {
      EXPECT_EQ(state[name].flatten()[static_cast<int64_t>(i)].item<float>(), values[i].get<float>()) << name;
    }
  }
  size_t stages = 0;
  ForwardOptions options;
  options.tap = [&](const std::string& stage, const torch::Tensor& value) {
    if (!golden.manifest["stages"].contains(stage)) return;
    const auto& expected = golden.manifest["stages"][stage];
    ++stages;
    ASSERT_EQ(value.size(0), expected["shape"][0].get<int64_t>()) << stage;
    ASSERT_EQ(value.size(1), expected["shape"][1].get<int64_t>()) << stage;
    EXPECT_NEAR(value.to(torch::kFloat64).mean().item<double>(), expected["mean"].get<double>(), 2e-5) << stage;
    EXPECT_NEAR(value.to(torch::kFloat64).std().item<double>(), expected["std"].get<double>(), 2e-5) << stage;
    for (int64_t i = 0; i < 6; ++i) {
      EXPECT_NEAR(value[0][i].item<double>(), expected["row0"][static_cast<size_t>(i)].get<double>(), 5e-5) << stage;
      EXPECT_NEAR(value[-1][i].item<double>(), expected["rowlast"][static_cast<size_t>(i)].get<double>(), 5e-5)
          << stage;
    }
  };
  torch::NoGradGuard no_grad;
  const torch::Tensor out = network(Table(golden.features), ToTensors(golden.Levels()), options).flatten(0, 1);
  EXPECT_EQ(stages, golden.manifest["stages"].size());
  EXPECT_LE((out - Table(golden.expected)).abs().max().item<double>(), 2e-5);
}

TEST(Modules, StateDictIsThatOfPublishedCheckpoints) {
  for (const auto& [copies, parameters] : {std::pair{20, 48123544}, std::pair{1, 47977814}}) {
    PublishedConfig config;
    config.copies = copies;
    AnchorSplatNetwork network(config);
    const auto state = network->StateDict();
    const auto expected = PublishedTensors(config);
    ASSERT_EQ(state.size(), expected.size());
    for (size_t i = 0; i < state.size(); ++i) {
      EXPECT_EQ(state[i].first, expected[i].name);
      EXPECT_EQ(state[i].second.sizes().vec(), expected[i].shape) << expected[i].name;
    }
    int64_t count = 0;
    for (const auto& parameter : network->parameters()) count += parameter.numel();
    EXPECT_EQ(count, parameters);
  }
}

TEST(PublishedModule, TheNetworkOfInferenceIsTheSameFunction) {
  const PublishedConfig config = SmallConfig();
  AnchorSplatNetwork network = HashNetwork(config);
  const SmallCloud cloud(config);
  torch::NoGradGuard no_grad;
  const torch::Tensor expected = network(cloud.features, cloud.hierarchy);

  const auto packed = PublishedNetwork::Load(config, WeightsOf(*network));
  ASSERT_TRUE(packed.ok());
  const int64_t n = cloud.features.size(0);
  const auto levels =
      BuildHierarchy(GridVoxels(cloud.features.data_ptr<float>(), n, kFeatures), HierarchyOptionsFor(config));
  const Buffer<float> context = packed->Context(cloud.features.data_ptr<float>(), *levels);
  torch::Tensor out = torch::empty({config.copies, n, kFeatures});
  packed->Gaussians(context.data(), cloud.features.data_ptr<float>(), n, out.data_ptr<float>());
  EXPECT_LE((out - expected).abs().max().item<double>(), 5e-6);
}

TEST(Modules, GradientMatchesDifferenceQuotients) {
  PublishedConfig config = SmallConfig();
  AnchorSplatNetwork network = HashNetwork(config);
  network->to(torch::kFloat64);
  SmallCloud cloud(config);
  const torch::Tensor features = cloud.features.to(torch::kFloat64);
  const torch::Tensor direction = torch::randn({config.copies, features.size(0), kFeatures}, torch::kFloat64);
  const auto loss = [&] { return (network(features, cloud.hierarchy) * direction).sum(); };
  loss().backward();
  int checked = 0;
  for (const auto& item : network->named_parameters()) {
    torch::Tensor parameter = item.value();
    // Along a random direction of each tensor: one number that every element enters. The maximum of the pooling and the
    // heads' ReLUs have kinks, so the step is small.
    const torch::Tensor step = torch::randn_like(parameter);
    const double expected = (parameter.grad() * step).sum().item<double>();
    torch::NoGradGuard no_grad;
    const double h = 1e-6;
    parameter.add_(step, h);
    const double above = loss().item<double>();
    parameter.add_(step, -2 * h);
    const double below = loss().item<double>();
    parameter.add_(step, h);
    EXPECT_NEAR((above - below) / (2 * h), expected, 1e-4 * (1 + std::fabs(expected))) << item.key();
    ++checked;
  }
  EXPECT_GT(checked, 100);
}

TEST(Modules, TrainingStartsAtTheAnchorsAndKeepsRunningStatistics) {
  PublishedConfig config = SmallConfig();
  torch::manual_seed(3);
  AnchorSplatNetwork network(config);
  const SmallCloud cloud(config);
  network->train();
  const torch::Tensor out = network(cloud.features, cloud.hierarchy);
  // Only the embeddings, N(0, 0.01²), stand between output and anchor; means pass ε·tanh besides.
  const torch::Tensor offset = out - cloud.features.unsqueeze(0);
  EXPECT_LT(offset.abs().max().item<double>(), 0.06);
  EXPECT_GT(offset.abs().max().item<double>(), 0.001);
  EXPECT_LT(offset.narrow(2, 0, 3).abs().max().item<double>(), 0.015 * 0.06);

  std::map<std::string, torch::Tensor> state;
  for (auto& [key, tensor] : network->StateDict()) state[key] = tensor;
  EXPECT_EQ(state["backbone.backbone.embedding.1.num_batches_tracked"].item<int64_t>(), 1);
  // Momentum 0.01: a hundredth of the way from (0, 1) to the batch's own statistics.
  EXPECT_LT((state["backbone.backbone.embedding.1.running_var"] - 1).abs().max().item<double>(), 0.05);
  EXPECT_GT((state["backbone.backbone.embedding.1.running_var"] - 1).abs().max().item<double>(), 0);

  // Spconv's initialisation: fan_in = 27 · channels.
  const double bound = 1 / std::sqrt(27.0 * 8);
  const double largest = state["backbone.backbone.enc.enc0.block0.cpe.0.weight"].abs().max().item<double>();
  EXPECT_LE(largest, bound);
  EXPECT_GT(largest, 0.9 * bound);
}

TEST(Modules, DropPathDropsRowsAndKeepsTheExpectation) {
  torch::manual_seed(4);
  const torch::Tensor x = torch::ones({20000, 3});
  EXPECT_TRUE(DropPath(x, 0.3, /*training=*/false).equal(x));
  const torch::Tensor y = DropPath(x, 0.3, /*training=*/true);
  EXPECT_TRUE(y.select(1, 0).equal(y.select(1, 2))) << "whole rows";
  EXPECT_NEAR(y.mean().item<double>(), 1, 0.02);
  EXPECT_NEAR(y.eq(0).to(torch::kFloat32).mean().item<double>(), 0.3, 0.02);
}

TEST(Modules, ShufflesChangeTheResult) {
  const PublishedConfig config = SmallConfig();
  AnchorSplatNetwork network = HashNetwork(config);
  const SmallCloud cloud(config, 200);
  torch::NoGradGuard no_grad;
  const auto run = [&](const Shuffles& shuffles) {
    return network(cloud.features,
                   ToTensors(*BuildHierarchy(GridVoxels(cloud.features.data_ptr<float>(), 200, kFeatures),
                                             HierarchyOptionsFor(config, shuffles)),
                             config.patch_size));
  };
  EXPECT_TRUE(run(kNoShuffles).equal(run(kNoShuffles)));
  EXPECT_FALSE(run(kNoShuffles).allclose(run(ShufflesFromSeed(918)), 0, 1e-4));
}

}  // namespace
}  // namespace anchorsplat
