#pragma once

#include <torch/torch.h>

#include <memory>

#include "core/result.h"

namespace anchorsplat {

// The processes of one training, which add up their gradients: on one machine or several, on CPUs (Gloo).
class ProcessGroup {
 public:
  virtual ~ProcessGroup() = default;

  // From the environment as torchrun sets it: WORLD_SIZE, RANK, MASTER_ADDR, MASTER_PORT. Null when WORLD_SIZE is not
  // set or 1. Waits until all processes are there. Addresses of this machine alone keep to its loopback device.
  // Errors: kBadArgument: a variable that is missing or no number; kIo: the others cannot be reached.
  static Result<std::unique_ptr<ProcessGroup>> FromEnvironment();

  virtual int rank() const = 0;
  virtual int size() const = 0;
  // Σ over all processes, in place, the same bits everywhere; for tensors of any device. Throws when another process is
  // gone.
  virtual void Sum(torch::Tensor& tensor) = 0;
  // The largest of all processes, element by element; else as Sum.
  virtual void Max(torch::Tensor& tensor) = 0;
};

}  // namespace anchorsplat
