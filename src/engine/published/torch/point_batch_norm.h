#pragma once

#include <torch/torch.h>

#include <cstdint>
#include <functional>
#include <utility>

namespace anchorsplat {

// Sums a tensor over all training processes, in place.
using SumOverProcesses = std::function<void(torch::Tensor&)>;

// BatchNorm over points as in PTv3 (eps 1e-3, momentum 0.01), with torch::nn::BatchNorm1d's names. With several
// training processes, mean and variance cover the points of all (SyncBatchNorm).
class PointBatchNormImpl : public torch::nn::Module {
 public:
  explicit PointBatchNormImpl(int64_t channels);

  torch::Tensor forward(const torch::Tensor& x);  // [N,C] → [N,C]

  // Enables SyncBatchNorm. All processes must then run every forward and backward pass, in the same order.
  void SynchroniseOver(SumOverProcesses sum) { sum_ = std::move(sum); }

  torch::Tensor weight, bias;                                    // [C]
  torch::Tensor running_mean, running_var, num_batches_tracked;  // [C], [C], one number

 private:
  torch::Tensor Synchronised(const torch::Tensor& x);

  SumOverProcesses sum_;
};
TORCH_MODULE(PointBatchNorm);

}  // namespace anchorsplat
