#pragma once

#include <torch/torch.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/result.h"
#include "network/torch/trainable_network.h"
#include "train/train_config.h"

namespace anchorsplat {

// Adam (Kingma and Ba 2015, with decoupled weight decay) on a network's parameters with a rate per group, and an
// exponential moving average of the weights for validation and saving. All state is in named tensors, so a checkpoint
// is a file of tensors.
class Optimizer {
 public:
  // Errors (kBadFile with the configuration's file): a rate for an unknown group.
  static Result<Optimizer> Make(TrainableNetwork& network, const TrainConfig& config);

  void ZeroGradients();
  double GradientNorm() const;  // over all trained parameters; not finite if a value is not
  void ScaleGradients(double factor);
  // Gradients of trained parameters, shared with autograd; creates zeros where there is none.
  std::vector<torch::Tensor> Gradients();

  // Updates weights and average. `factor` multiplies all rates.
  void Step(double factor);
  int64_t steps() const { return steps_; }
  void set_steps(int64_t steps) { steps_ = steps; }

  // Swaps weights and averages. Call before and after a validation or a Save.
  void SwapAverage();

  // All tensors a checkpoint needs, by name, sharing memory.
  std::vector<std::pair<std::string, torch::Tensor>> State() const;
  int64_t parameters() const;  // number of trained values

 private:
  struct Trained {
    std::string name;
    torch::Tensor value, first, second;
    double rate = 0;
  };
  struct Averaged {
    std::string name;
    torch::Tensor value, average;
  };

  OptimizerConfig config_;
  int64_t steps_ = 0;
  std::vector<Trained> trained_;
  std::vector<Averaged> averaged_;  // parameters and buffers
};

// Factor of all learning rates. `progress`: elapsed share of the training, 0–1.
double RateFactor(const OptimizerConfig& config, int64_t step, double progress);

}  // namespace anchorsplat
