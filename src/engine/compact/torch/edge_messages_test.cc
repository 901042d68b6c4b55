#include "compact/torch/edge_messages.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

namespace anchorsplat {
namespace {

using torch::Tensor;

struct Case {
  std::vector<Tensor> inputs;  // own, other, edge weight, message weight, message bias; with gradients
  Tensor edges;
  EdgeIndex index;

  // n points that read themselves and `more` others.
  Case(int64_t n, int64_t m, int64_t h, int64_t more = 0) {
    torch::manual_seed(n + m);
    const Tensor far = m > 0 ? torch::randint(n + more, {n * m}, torch::kInt64) : torch::empty({0}, torch::kInt64);
    index = MakeEdgeIndex(far, n, n + more);
    edges = torch::randn({n * m, 5});
    for (const std::vector<int64_t>& shape : {std::vector<int64_t>{n, h}, {n + more, h}, {h, 5}, {h, h}, {h}}) {
      inputs.push_back(torch::randn(shape).requires_grad_());
    }
  }

  // Pooled messages, and the gradients of a sum of them with random signs.
  template <typename Function>
  std::vector<Tensor> Run(Function&& function) {
    const Tensor pooled = function(inputs[0], inputs[1], edges, index, inputs[2], inputs[3], inputs[4]);
    torch::manual_seed(1);
    (pooled * torch::randn_like(pooled)).sum().backward();
    std::vector<Tensor> out = {pooled.detach()};
    for (Tensor& input : inputs) {
      out.push_back(input.grad().defined() ? input.grad().clone() : torch::zeros_like(input));
      input.mutable_grad() = Tensor();
    }
    return out;
  }
};

TEST(EdgeMessages, BlocksEqualThePlainForm) {
  for (const auto& [n, m, more] :
       {std::array<int64_t, 3>{1, 1, 0}, {7, 3, 0}, {600, 8, 0}, {256, 2, 0}, {300, 8, 170}, {1, 4, 9}}) {
    Case both(n, m, 32, more);
    const auto plain = both.Run(PooledMessagesPlain), blocks = both.Run(PooledMessages);
    for (size_t i = 0; i < plain.size(); ++i) {
      const double most = plain[i].abs().max().item<double>();
      EXPECT_LT((blocks[i] - plain[i]).abs().max().item<double>(), 1e-5 * most)
          << n << " + " << more << " points, output " << i;
    }
  }
}

TEST(EdgeMessages, WithoutNeighboursThereIsNothing) {
  Case one(3, 0, 16);
  EXPECT_EQ(
      PooledMessages(one.inputs[0], one.inputs[1], one.edges, one.index, one.inputs[2], one.inputs[3], one.inputs[4])
          .abs()
          .sum()
          .item<float>(),
      0);
}

TEST(EdgeMessages, SameBitsForAnyNumberOfThreads) {
  Case both(1500, 4, 16);
  const int before = torch::get_num_threads();
  torch::set_num_threads(1);
  const auto one = both.Run(PooledMessages);
  torch::set_num_threads(3);
  const auto three = both.Run(PooledMessages);
  torch::set_num_threads(before);
  for (size_t i = 0; i < one.size(); ++i) EXPECT_TRUE(torch::equal(one[i], three[i])) << i;
}

}  // namespace
}  // namespace anchorsplat
