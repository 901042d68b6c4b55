#include "gpu/with_webgpu/webgpu_instance.h"

#include <algorithm>
#include <chrono>
#include <thread>
#include <tuple>
#include <utility>

#include "core/text.h"
#include "gpu/with_webgpu/abort_guard.h"
#include "gpu/with_webgpu/library_search.h"

namespace anchorsplat {

namespace {

std::mutex module_folder_mutex;

std::filesystem::path& ModuleFolder() {
  static std::filesystem::path& folder = *new std::filesystem::path;
  return folder;
}

const char* BackendWord(WGPUBackendType type) {
  switch (type) {
    case WGPUBackendType_D3D11:
      return "D3D11";
    case WGPUBackendType_D3D12:
      return "D3D12";
    case WGPUBackendType_Metal:
      return "Metal";
    case WGPUBackendType_Vulkan:
      return "Vulkan";
    case WGPUBackendType_OpenGL:
      return "OpenGL";
    case WGPUBackendType_OpenGLES:
      return "OpenGL ES";
    default:
      return "unknown";
  }
}

GpuAdapter::Type TypeOf(WGPUAdapterType type) {
  switch (type) {
    case WGPUAdapterType_DiscreteGPU:
      return GpuAdapter::Type::kDiscrete;
    case WGPUAdapterType_IntegratedGPU:
      return GpuAdapter::Type::kIntegrated;
    case WGPUAdapterType_CPU:
      return GpuAdapter::Type::kCpu;
    default:
      return GpuAdapter::Type::kUnknown;
  }
}

// Limits that every kernel can rely on: the minimum of WebGPU outside its compatibility mode.
std::string WhyUnusable(const WGPUAdapterInfo& info, const WGPULimits& limits) {
  if (info.backendType == WGPUBackendType_Null) return "it is a null adapter, which calculates nothing";
  if (limits.maxStorageBuffersPerShaderStage < 8) {
    return Cat("a kernel sees only ", limits.maxStorageBuffersPerShaderStage, " buffers on it, and 8 are needed");
  }
  if (limits.maxComputeWorkgroupStorageSize < 16384) {
    return Cat("a workgroup has only ", limits.maxComputeWorkgroupStorageSize, " bytes on it, and 16,384 are needed");
  }
  if (limits.maxComputeInvocationsPerWorkgroup < 256) {
    return Cat("a workgroup has only ", limits.maxComputeInvocationsPerWorkgroup, " threads on it, and 256 are needed");
  }
  return {};
}

// Bindings are multiples of 4 bytes, offsets of 256 bytes; "unlimited" sizes are capped below 2^63.
uint64_t WholeSteps(uint64_t bytes) { return std::min(bytes, uint64_t{1} << 62) / 256 * 256; }

GpuAdapter Describe(const WebGpuApi& api, WGPUAdapter adapter) {
  WGPUAdapterInfo info = WGPU_ADAPTER_INFO_INIT;
  api.AdapterGetInfo(adapter, &info);
  WGPULimits limits = WGPU_LIMITS_INIT;
  api.AdapterGetLimits(adapter, &limits);
  GpuAdapter described{.number = 0,
                       .name = TextOf(info.device),
                       .driver = TextOf(info.description),
                       .backend = BackendWord(info.backendType),
                       .type = TypeOf(info.adapterType),
                       .max_binding = WholeSteps(limits.maxStorageBufferBindingSize),
                       .max_buffer = WholeSteps(limits.maxBufferSize),
                       .max_storage_buffers = limits.maxStorageBuffersPerShaderStage,
                       .max_workgroup_memory = limits.maxComputeWorkgroupStorageSize,
                       .timestamps = api.AdapterHasFeature(adapter, WGPUFeatureName_TimestampQuery) != 0,
                       .unusable = WhyUnusable(info, limits)};
  if (described.name.empty()) described.name = TextOf(info.vendor);
  api.AdapterInfoFreeMembers(info);
  return described;
}

}  // namespace

void WebGpuInstance::SetModuleFolder(const std::filesystem::path& folder) {
  const std::lock_guard lock(module_folder_mutex);
  ModuleFolder() = folder;
}

WebGpuInstance& WebGpuInstance::OfProcess() {
  static WebGpuInstance& instance = *new WebGpuInstance;
  return instance;
}

WebGpuInstance::WebGpuInstance() {
  LibrarySearch search;
  {
    const std::lock_guard lock(module_folder_mutex);
    search = LibrarySearchOfProcess(ModuleFolder());
  }
  const std::vector<std::string> candidates = LibraryCandidates(search);
  for (const std::string& path : candidates) {
    Result<WebGpuApi> loaded = LoadWebGpu(path);
    if (loaded.ok()) {
      api_ = *std::move(loaded);
      problem_.clear();
      break;
    }
    if (problem_.empty()) problem_ = loaded.error().message;
  }
  if (!api_) {
    if (!search.named.empty()) {
      problem_ = Cat("ANCHORSPLAT_WEBGPU: ", problem_);
    } else if (candidates.size() == 1) {
      problem_ = "no WebGPU library was found: run pip install wgpu==0.32.0, or set ANCHORSPLAT_WEBGPU to its file";
    }
    return;
  }
  WGPUInstanceDescriptor descriptor = WGPU_INSTANCE_DESCRIPTOR_INIT;
  const WGPUInstanceFeatureName timed_wait = WGPUInstanceFeatureName_TimedWaitAny;
  if (api_->InstanceWaitAny != nullptr && api_->HasInstanceFeature != nullptr &&
      api_->HasInstanceFeature(timed_wait) != 0) {
    descriptor.requiredFeatures = &timed_wait;
    descriptor.requiredFeatureCount = 1;
    waits_with_timeout_ = true;
  }
  instance_ = api_->CreateInstance(&descriptor);
  if (instance_ == nullptr) {
    problem_ = Cat("the WebGPU library ", api_->path, " does not start");
    api_.reset();
  }
}

bool WebGpuInstance::WaitUntil(const std::function<bool()>& done, WGPUDevice device, WGPUFuture future) {
  // The library's waits return when nothing is pending: after this many returns without an answer, none will come.
  constexpr int kPatience = 10000;
  constexpr uint64_t kNanoseconds = 100'000'000;
  for (int ends = 0; !done() && ends < kPatience;) {
    if (broken_) return false;
    if (api_->DevicePoll != nullptr && device != nullptr) {
      if (!SurvivesAbort([&] { api_->DevicePoll(device, 1, nullptr); })) {
        Break();
        return false;
      }
      ++ends;
    } else if (waits_with_timeout_ && future.id != 0) {
      WGPUFutureWaitInfo wait = WGPU_FUTURE_WAIT_INFO_INIT;
      wait.future = future;
      ends += api_->InstanceWaitAny(instance_, 1, &wait, kNanoseconds) == WGPUWaitStatus_TimedOut ? 0 : 1;
    }
    if (done()) break;
    api_->InstanceProcessEvents(instance_);
    if (!done()) std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  return done();
}

std::vector<FoundAdapter> WebGpuInstance::Adapters() {
  std::vector<FoundAdapter> found;
  if (!api_ || broken_) return found;
  std::vector<WGPUAdapter> handles;
  if (api_->InstanceEnumerateAdapters != nullptr) {
    handles.resize(api_->InstanceEnumerateAdapters(instance_, nullptr, nullptr));
    if (!handles.empty()) api_->InstanceEnumerateAdapters(instance_, nullptr, handles.data());
  } else {
    // The standard can only request a matching adapter, not list them.
    for (const auto& [preference, fallback] :
         {std::pair(WGPUPowerPreference_HighPerformance, 0), std::pair(WGPUPowerPreference_LowPower, 0),
          std::pair(WGPUPowerPreference_Undefined, 1)}) {
      struct Answer {
        WGPUAdapter adapter = nullptr;
        bool done = false;
      };
      auto* const answer = new Answer;
      WGPURequestAdapterOptions options = WGPU_REQUEST_ADAPTER_OPTIONS_INIT;
      options.powerPreference = preference;
      options.forceFallbackAdapter = static_cast<WGPUBool>(fallback);
      WGPURequestAdapterCallbackInfo callback = WGPU_REQUEST_ADAPTER_CALLBACK_INFO_INIT;
      callback.mode = WGPUCallbackMode_AllowProcessEvents;
      callback.callback = [](WGPURequestAdapterStatus, WGPUAdapter adapter, WGPUStringView, void* to, void*) {
        static_cast<Answer*>(to)->adapter = adapter;
        static_cast<Answer*>(to)->done = true;
      };
      callback.userdata1 = answer;
      const WGPUFuture future = api_->InstanceRequestAdapter(instance_, &options, callback);
      // A pending callback still writes to its slot.
      if (!WaitUntil([&] { return answer->done; }, nullptr, future)) continue;
      if (answer->adapter != nullptr) handles.push_back(answer->adapter);
      delete answer;
    }
  }
  const bool asked_one_by_one = api_->InstanceEnumerateAdapters == nullptr;
  for (WGPUAdapter handle : handles) {
    auto kept = std::make_unique<AdapterHandle>(*api_, handle);
    GpuAdapter described = Describe(*api_, handle);
    const auto same = [&](const FoundAdapter& other) {
      const GpuAdapter& that = other.description;
      return std::tie(that.name, that.driver, that.backend) ==
             std::tie(described.name, described.driver, described.backend);
    };
    if (asked_one_by_one && std::any_of(found.begin(), found.end(), same)) continue;
    described.number = static_cast<int>(found.size());
    found.push_back({std::move(described), std::move(kept)});
  }
  return found;
}

}  // namespace anchorsplat
