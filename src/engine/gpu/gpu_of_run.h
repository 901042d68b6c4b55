#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "core/device_choice.h"
#include "core/result.h"
#include "gpu/device.h"

namespace anchorsplat::internal {

// State of GpuOfRun and GiveUpGpu (open_gpu.h) in a run.
struct GpuStateOfRun {
  std::mutex mutex;
  std::string given_up;                    // reason; empty: not given up
  std::optional<DeviceChoice> opened_for;  // the choice that led to `opened`
  std::optional<Result<std::shared_ptr<GpuDevice>>> opened;
  std::shared_ptr<GpuDevice> for_test;  // returned instead of `opened`
};

}  // namespace anchorsplat::internal
