#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <mutex>
#include <utility>

#include "core/device_choice.h"
#include "core/run_context.h"
#include "gpu/device.h"
#include "gpu/gpu_of_run.h"
#include "gpu/open_gpu.h"

namespace anchorsplat {

// A device for tests, of any type; fails the test and returns null if there is none.
inline std::shared_ptr<GpuDevice> GpuForTest() {
  Result<std::shared_ptr<GpuDevice>> opened = OpenGpu({DeviceChoice::Kind::kGpu});
  if (opened.ok()) return *opened;
  ADD_FAILURE() << "Tests of the GPU need a WebGPU library (scripts/fetch-webgpu.sh, then configure again) and a "
                   "driver, at least the software one (apt-get install mesa-vulkan-drivers libvulkan1): "
                << opened.error().message;
  return nullptr;
}

// While it lives, GpuOfRun() of this thread's run returns the given device, unless the run chose the CPU or gave up the
// GPU. Resets an earlier give-up.
class ScopedGpuForTest {
 public:
  explicit ScopedGpuForTest(std::shared_ptr<GpuDevice> gpu)
      : state_(internal::CurrentStorage().Get<internal::GpuStateOfRun>()) {
    const std::lock_guard lock(state_->mutex);
    state_->for_test = std::move(gpu);
    state_->given_up.clear();
  }
  ~ScopedGpuForTest() {
    const std::lock_guard lock(state_->mutex);
    state_->for_test = nullptr;
    state_->given_up.clear();
  }
  ScopedGpuForTest(const ScopedGpuForTest&) = delete;
  ScopedGpuForTest& operator=(const ScopedGpuForTest&) = delete;

 private:
  std::shared_ptr<internal::GpuStateOfRun> state_;
};

}  // namespace anchorsplat
