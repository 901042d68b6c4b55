#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "core/device_choice.h"
#include "core/result.h"
#include "gpu/device.h"

namespace anchorsplat::internal {

// What GpuOfRun and GiveUpGpu (open_gpu.h) know of a run.
struct GpuStateOfRun {
  std::mutex mutex;
  std::string given_up;                    // why; empty: not
  std::optional<DeviceChoice> opened_for;  // the choice that `opened` answers
  std::optional<Result<std::shared_ptr<GpuDevice>>> opened;
  std::shared_ptr<GpuDevice> for_test;  // instead of what would be opened
};

}  // namespace anchorsplat::internal
