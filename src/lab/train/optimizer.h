#pragma once

#include <torch/torch.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/result.h"
#include "model/shared/torch/trainable_network.h"
#include "train/train_config.h"

namespace anchorsplat {

// Adam (Kingma and Ba 2015, with decoupled weight decay) over the parameters of a network, a rate per group, and the
// running average of the weights that validations and saved networks take. All state is in named
// tensors, so that a checkpoint is a file of tensors.
class Optimizer {
 public:
  // Errors (kBadFile with the configuration's file): a rate for a group that the network does not have.
  static Result<Optimizer> Make(TrainableNetwork& network, const TrainConfig& config);

  void ZeroGradients();
  double GradientNorm() const;  // of all parameters that are trained; not finite when one value is not
  void ScaleGradients(double factor);
  // Gradients of trained parameters, each where autograd left it; parameters without one are given zeros.
  std::vector<torch::Tensor> Gradients();

  // One update of weights and average. `factor` multiplies all rates.
  void Step(double factor);
  int64_t steps() const { return steps_; }
  void set_steps(int64_t steps) { steps_ = steps; }

  // Exchanges weights and averages: before a validation or a Save, and again after it.
  void SwapAverage();

  // Every tensor that the rest of a training depends on, by name; they share memory with what is in use.
  std::vector<std::pair<std::string, torch::Tensor>> State() const;
  int64_t parameters() const;  // numbers that are trained

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

// The factor of all learning rates. `progress` is the part of the training that is done, 0 to 1.
double RateFactor(const OptimizerConfig& config, int64_t step, double progress);

}  // namespace anchorsplat
