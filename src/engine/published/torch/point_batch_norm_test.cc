#include "published/torch/point_batch_norm.h"

#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

#include "published/published_config.h"

namespace anchorsplat {
namespace {

// Two threads that add up their tensors as two processes would.
class Pair {
 public:
  void Sum(torch::Tensor& own) {
    std::unique_lock<std::mutex> lock(mutex_);
    if (!first_.defined()) {
      first_ = own;
      const int64_t round = round_;
      changed_.wait(lock, [&] { return round_ != round; });
      return;
    }
    const torch::Tensor total = first_ + own;
    first_.copy_(total);
    own.copy_(total);
    first_ = torch::Tensor();
    ++round_;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  torch::Tensor first_;
  int64_t round_ = 0;
};

TEST(PointBatchNorm, IsTorchsBatchNormWithPtv3sNumbers) {
  torch::manual_seed(1);
  PointBatchNorm ours(5);
  torch::nn::BatchNorm1d theirs(torch::nn::BatchNorm1dOptions(5).eps(kBatchNormEpsilon).momentum(kBatchNormMomentum));
  const torch::Tensor x = torch::randn({40, 5}) * 3 + 1;
  EXPECT_TRUE(ours(x).equal(theirs(x)));
  EXPECT_TRUE(ours->running_var.equal(theirs->running_var));
  EXPECT_EQ(ours->num_batches_tracked.item<int64_t>(), 1);
  ours->eval();
  theirs->eval();
  EXPECT_TRUE(ours(x).equal(theirs(x)));
}

TEST(PointBatchNorm, TwoHalvesSynchronisedAreOneWhole) {
  torch::manual_seed(2);
  const torch::Tensor x = torch::randn({50, 4}) * 2 + 7, weights = torch::randn({50, 4});
  const torch::Tensor gain = torch::randn({4});
  const auto make = [&] {
    PointBatchNorm norm(4);
    const torch::NoGradGuard no_gradient;
    norm->weight.copy_(gain);
    return norm;
  };
  PointBatchNorm whole = make();
  const torch::Tensor input = x.clone().requires_grad_(true);
  const torch::Tensor expected = whole(input);
  (expected * weights).sum().backward();

  Pair pair;
  std::vector<PointBatchNorm> norms = {make(), make()};
  std::vector<torch::Tensor> inputs, outputs(2);
  const std::vector<std::pair<int64_t, int64_t>> parts = {{0, 20}, {20, 50}};
  std::vector<std::thread> threads;
  for (const auto& [begin, end] : parts) inputs.push_back(x.slice(0, begin, end).clone().requires_grad_(true));
  for (size_t r = 0; r < 2; ++r) {
    threads.emplace_back([&, r] {
      norms[r]->SynchroniseOver([&](torch::Tensor& t) { pair.Sum(t); });
      outputs[r] = norms[r](inputs[r]);
      (outputs[r] * weights.slice(0, parts[r].first, parts[r].second)).sum().backward();
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_LT((torch::cat(outputs) - expected).abs().max().item<float>(), 1e-5);
  const torch::Tensor gradient = torch::cat({inputs[0].grad(), inputs[1].grad()});
  EXPECT_LT((gradient - input.grad()).abs().max().item<float>(), 1e-5);
  EXPECT_GT(input.grad().abs().max().item<float>(), 0.01);
  EXPECT_LT((norms[0]->weight.grad() + norms[1]->weight.grad() - whole->weight.grad()).abs().max().item<float>(), 1e-4);
  EXPECT_LT((norms[1]->running_var - whole->running_var).abs().max().item<float>(), 1e-6);
  EXPECT_LT((norms[0]->running_mean - whole->running_mean).abs().max().item<float>(), 1e-6);
}

}  // namespace
}  // namespace anchorsplat
