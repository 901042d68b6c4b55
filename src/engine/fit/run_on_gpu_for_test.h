#pragma once

#include <atomic>
#include <memory>
#include <utility>

#include "core/run_context.h"
#include "gpu/device.h"
#include "gpu/gpu_for_test.h"

namespace anchorsplat {

// Runs on the given GPU during its lifetime.
class RunOnGpu {
 public:
  explicit RunOnGpu(std::shared_ptr<GpuDevice> device, const std::atomic<bool>* stop = nullptr)
      : scope_({.stop = stop, .device = DeviceChoice{DeviceChoice::Kind::kGpu}}), gpu_(std::move(device)) {}

 private:
  RunScope scope_;
  ScopedGpuForTest gpu_;
};

}  // namespace anchorsplat
