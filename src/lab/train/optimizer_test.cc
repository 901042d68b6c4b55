#include "train/optimizer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace anchorsplat {
namespace {

// Two tensors in two groups and one that is not trained.
class SmallNetwork : public TrainableNetwork {
 public:
  SmallNetwork() {
    first = register_parameter("first", torch::tensor({1.0f, -2.0f, 0.5f}));
    second = register_parameter("second", torch::tensor({3.0f, 0.1f}));
    frozen = register_parameter("frozen", torch::tensor({7.0f}));
    seen = register_buffer("seen", torch::tensor({0.0f}));
  }
  Result<std::shared_ptr<void>> Prepare(const NetworkInput&) override { return std::shared_ptr<void>(); }
  GaussianTensors Forward(const NetworkInput&) override { return {}; }
  int copies() const override { return 1; }
  std::vector<std::pair<std::string, std::vector<torch::Tensor>>> Groups() override {
    return {{"a", {first}}, {"b", {second}}};
  }
  Status Save(const std::filesystem::path&, const std::map<std::string, std::string>&) override { return {}; }

  torch::Tensor first, second, frozen, seen;
};

TrainConfig Config() {
  TrainConfig config;
  config.file = "x.toml";
  config.optimizer.learning_rate = 1e-2;
  config.optimizer.groups["b"] = 1e-3;
  config.optimizer.weight_decay = 0.1;
  return config;
}

torch::Tensor Loss(const SmallNetwork& n) {
  return (n.first * n.first.detach().sin()).sum() + n.second.square().sum() * n.first.select(0, 1);
}

TEST(Optimizer, IsTorchsAdamWWithARatePerGroup) {
  SmallNetwork ours, theirs;
  auto optimizer = Optimizer::Make(ours, Config());
  ASSERT_TRUE(optimizer.ok());
  EXPECT_EQ(optimizer->parameters(), 5);
  using Options = torch::optim::AdamWOptions;
  torch::optim::AdamW reference(
      {torch::optim::OptimizerParamGroup({theirs.first}, std::make_unique<Options>(Options(1e-2).weight_decay(0.1))),
       torch::optim::OptimizerParamGroup({theirs.second}, std::make_unique<Options>(Options(1e-3).weight_decay(0.1)))});
  for (int step = 0; step < 5; ++step) {
    optimizer->ZeroGradients();
    Loss(ours).backward();
    optimizer->Step(1);
    reference.zero_grad();
    Loss(theirs).backward();
    reference.step();
  }
  EXPECT_LT((ours.first - theirs.first).abs().max().item<float>(), 1e-6);
  EXPECT_LT((ours.second - theirs.second).abs().max().item<float>(), 1e-6);
  EXPECT_GT((ours.first - SmallNetwork().first).abs().min().item<float>(), 1e-3);
  EXPECT_EQ(ours.frozen.item<float>(), 7);
}

TEST(Optimizer, AveragesAreExchangedAndBack) {
  SmallNetwork network;
  TrainConfig config = Config();
  config.optimizer.ema = 0.5;
  auto optimizer = Optimizer::Make(network, config);
  ASSERT_TRUE(optimizer.ok());
  const torch::Tensor before = network.first.detach().clone();
  Loss(network).backward();
  optimizer->Step(1);
  network.seen.fill_(5);
  const torch::Tensor after = network.first.detach().clone();
  optimizer->SwapAverage();
  const double keep = std::min(0.5, 2.0 / 11);
  EXPECT_TRUE(network.first.detach().allclose(before * keep + after * (1 - keep), 1e-5, 1e-7));
  EXPECT_EQ(network.seen.item<float>(), 0) << "buffers are copied at the next step";
  optimizer->SwapAverage();
  EXPECT_TRUE(network.first.detach().equal(after));
  EXPECT_EQ(network.seen.item<float>(), 5);
}

TEST(Optimizer, NormsAndGradients) {
  SmallNetwork network;
  auto optimizer = Optimizer::Make(network, Config());
  ASSERT_TRUE(optimizer.ok());
  EXPECT_EQ(optimizer->GradientNorm(), 0);
  network.first.mutable_grad() = torch::tensor({3.0f, 0.0f, 4.0f});
  EXPECT_NEAR(optimizer->GradientNorm(), 5, 1e-6);
  optimizer->ScaleGradients(0.5);
  EXPECT_NEAR(optimizer->GradientNorm(), 2.5, 1e-6);
  EXPECT_EQ(optimizer->Gradients().size(), 2u);
  EXPECT_EQ(network.second.grad().abs().max().item<float>(), 0) << "zeros where there was no gradient";
  network.first.mutable_grad()[1] = std::nanf("");
  EXPECT_FALSE(std::isfinite(optimizer->GradientNorm()));
  TrainConfig config = Config();
  config.optimizer.groups["c"] = 1;
  const auto unknown = Optimizer::Make(network, config);
  ASSERT_FALSE(unknown.ok());
  EXPECT_THAT(unknown.error().message, testing::HasSubstr("x.toml: optimizer.groups.c"));
}

TEST(RateFactor, WarmsUpAndFalls) {
  OptimizerConfig config;
  config.warm_up = 10;
  config.final = 0.1;
  EXPECT_NEAR(RateFactor(config, 0, 0), 0.1, 1e-12);
  EXPECT_NEAR(RateFactor(config, 10, 0), 1, 1e-12);
  EXPECT_NEAR(RateFactor(config, 50, 0.5), 0.55, 1e-12);
  EXPECT_NEAR(RateFactor(config, 100, 1), 0.1, 1e-12);
  config.schedule = Schedule::kConstant;
  EXPECT_NEAR(RateFactor(config, 99, 1), 1, 1e-12);
}

}  // namespace
}  // namespace anchorsplat
