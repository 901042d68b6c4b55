#pragma once

#include <torch/torch.h>

#include <memory>

#include "core/result.h"

namespace anchorsplat {

// The processes of a distributed training, which sum their gradients: on one or several machines, on CPUs (Gloo).
class ProcessGroup {
 public:
  virtual ~ProcessGroup() = default;

  // From torchrun's environment: WORLD_SIZE, RANK, MASTER_ADDR, MASTER_PORT. Null if WORLD_SIZE is unset or 1. Waits
  // for all processes. Addresses of this machine use its loopback device only.
  // Errors: kBadArgument: a variable missing or not a number; kIo: the others cannot be reached.
  static Result<std::unique_ptr<ProcessGroup>> FromEnvironment();

  virtual int rank() const = 0;
  virtual int size() const = 0;
  // Sums over all processes in place, to the same bits everywhere, on any device. Throws if another process is gone.
  virtual void Sum(torch::Tensor& tensor) = 0;
  // Element-wise maximum over all processes; otherwise like Sum.
  virtual void Max(torch::Tensor& tensor) = 0;
};

}  // namespace anchorsplat
