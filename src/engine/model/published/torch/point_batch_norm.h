#pragma once

#include <torch/torch.h>

#include <cstdint>
#include <functional>
#include <utility>

namespace anchorsplat {

// Adds up a tensor over all processes of a training, in place.
using SumOverProcesses = std::function<void(torch::Tensor&)>;

// BatchNorm over points as PTv3 has it (eps 1e-3, momentum 0.01), with the names of torch::nn::BatchNorm1d. Trained by
// several processes, mean and variance are those of all their points together (SyncBatchNorm).
class PointBatchNormImpl : public torch::nn::Module {
 public:
  explicit PointBatchNormImpl(int64_t channels);

  torch::Tensor forward(const torch::Tensor& x);  // [N,C] → [N,C]

  // From now on while training. Every process must come to every forward and backward pass, in the same order.
  void SynchroniseOver(SumOverProcesses sum) { sum_ = std::move(sum); }

  torch::Tensor weight, bias;                                    // [C]
  torch::Tensor running_mean, running_var, num_batches_tracked;  // [C], [C], one number

 private:
  torch::Tensor Synchronised(const torch::Tensor& x);

  SumOverProcesses sum_;
};
TORCH_MODULE(PointBatchNorm);

}  // namespace anchorsplat
