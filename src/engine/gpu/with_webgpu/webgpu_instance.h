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

// An adapter for as long as something is asked of it.
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

// The library and its instance: one of the process, never given back, as drivers have threads that outlive main().
class WebGpuInstance {
 public:
  // Made at the first call; `problem` of those after a failure is the same.
  static WebGpuInstance& OfProcess();
  static void SetModuleFolder(const std::filesystem::path& folder);

  // Null where there is no library; then problem() is one sentence.
  const WebGpuApi* api() const { return api_ ? &*api_ : nullptr; }
  const std::string& problem() const { return problem_; }
  WGPUInstance get() const { return instance_; }

  std::vector<FoundAdapter> Adapters();

  // Runs callbacks until `done`; waits for the GPU meanwhile where `device` is given. False: it will not be done, as
  // the library has given up or answers nothing any more.
  bool WaitUntil(const std::function<bool()>& done, WGPUDevice device, WGPUFuture future);

  // After an abort in the library (abort_guard.h) nothing more of it is called.
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
