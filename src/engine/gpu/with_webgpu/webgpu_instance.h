#pragma once

#include <webgpu.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "gpu/device.h"
#include "gpu/with_webgpu/webgpu_api.h"

namespace anchorsplat {

// Owns an adapter handle.
class AdapterHandle {
 public:
  AdapterHandle(const WebGpuApi& api, WGPUAdapter adapter) : api_(api), adapter_(adapter) {}
  ~AdapterHandle() { api_.AdapterRelease(adapter_); }
  AdapterHandle(const AdapterHandle&) = delete;
  AdapterHandle& operator=(const AdapterHandle&) = delete;
  WGPUAdapter get() const { return adapter_; }

 private:
  const WebGpuApi& api_;
  WGPUAdapter adapter_;
};

struct FoundAdapter {
  GpuAdapter description;
  std::unique_ptr<AdapterHandle> handle;
};

// The library and its instance: one per process, never released, as driver threads outlive main().
class WebGpuInstance {
 public:
  // Created by the first call; a failure is permanent.
  static WebGpuInstance& OfProcess();
  static void SetModuleFolder(const std::filesystem::path& folder);

  // Null without a library; problem() then gives the reason in one sentence.
  const WebGpuApi* api() const { return api_ ? &*api_ : nullptr; }
  const std::string& problem() const { return problem_; }
  WGPUInstance get() const { return instance_; }

  std::vector<FoundAdapter> Adapters();

  // Runs callbacks until `done`; waits for the GPU meanwhile if `device` is given. False: the library failed or stopped
  // answering.
  bool WaitUntil(const std::function<bool()>& done, WGPUDevice device, WGPUFuture future);

  // Set after an abort in the library (abort_guard.h), which must then not be called any more.
  bool broken() const { return broken_; }
  void Break() { broken_ = true; }

 private:
  WebGpuInstance();

  std::optional<WebGpuApi> api_;
  std::string problem_;
  WGPUInstance instance_ = nullptr;
  bool waits_with_timeout_ = false;
  std::atomic<bool> broken_ = false;
};

}  // namespace anchorsplat
