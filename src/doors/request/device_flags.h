#pragma once

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "core/device_choice.h"
#include "core/run_context.h"
#include "gpu/device.h"

namespace anchorsplat {

inline constexpr const char* kDeviceGroup = "Device";

// Options of verbs that rasterize: device and memory.
struct DeviceFlags {
  DeviceChoice device;
  uint64_t max_gpu_memory = kDefaultGpuMemory;  // bytes

  void AddTo(CLI::App& verb);
};

// Measures the use of the device of this thread's run from construction on, for reports.
class DeviceUse {
 public:
  DeviceUse();

  // {"name": "cpu"}; or for a GPU "name", "backend", "type", the "seconds" that the run waited for it and their "share"
  // of the time. "gave_up": why the run continued on the CPU, if it did.
  nlohmann::json ToJson() const;

 private:
  std::shared_ptr<GpuDevice> gpu_;  // null: the CPU
  double spent_before_ = 0;         // seconds
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

// "discrete", "integrated", "cpu", "unknown".
const char* NameOf(GpuAdapter::Type type);

}  // namespace anchorsplat
