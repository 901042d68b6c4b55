#pragma once

#include <webgpu.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

#include "gpu/device.h"
#include "gpu/with_webgpu/webgpu_device.h"

namespace anchorsplat {

// Bytes allocated by a run on all devices.
struct GpuMemoryOfRun {
  std::atomic<uint64_t> bytes = 0;
};

class WebGpuDevice::Buffer final : public GpuBuffer {
 public:
  Buffer(std::shared_ptr<WebGpuDevice> device, WGPUBuffer handle, uint64_t bytes,
         std::shared_ptr<GpuMemoryOfRun> of_run)
      : GpuBuffer(bytes), device_(std::move(device)), handle_(handle), of_run_(std::move(of_run)) {}
  ~Buffer() override {
    of_run_->bytes -= bytes();
    device_->Retire(handle_, last_used_);
  }

  static WGPUBuffer HandleOf(const GpuBuffer& buffer) { return static_cast<const Buffer&>(buffer).handle_; }
  static WGPUBuffer Use(const GpuBuffer& buffer, uint64_t recording) {
    const auto& ours = static_cast<const Buffer&>(buffer);
    ours.last_used_ = recording;
    return ours.handle_;
  }
  static uint64_t LastUsed(const GpuBuffer& buffer) { return static_cast<const Buffer&>(buffer).last_used_; }

 private:
  std::shared_ptr<WebGpuDevice> device_;
  WGPUBuffer handle_;
  std::shared_ptr<GpuMemoryOfRun> of_run_;
  mutable uint64_t last_used_ = 0;  // number of the recording; guarded by the device's mutex
};

}  // namespace anchorsplat
