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

// The options of every verb that rasterizes: on what, and with how much of its memory.
struct DeviceFlags {
  DeviceChoice device;
  uint64_t max_gpu_memory = kDefaultGpuMemory;  // bytes

  void AddTo(CLI::App& verb);
};

// What the device of this thread's run has to do from the making of the object on, for reports.
class DeviceUse {
 public:
  DeviceUse();

  // {"name": "cpu"}, or of a GPU its "name", "backend" and "type", the "seconds" for which the run waited for it and
  // their "share" of all the time since; of either "gave_up", why the run went on on the CPU, where it did.
  nlohmann::json ToJson() const;

 private:
  std::shared_ptr<GpuDevice> gpu_;  // null: the CPU
  double spent_before_ = 0;         // seconds
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

// "discrete", "integrated", "cpu", "unknown".
const char* NameOf(GpuAdapter::Type type);

}  // namespace anchorsplat
