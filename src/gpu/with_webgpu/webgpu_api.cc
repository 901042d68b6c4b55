#include "gpu/with_webgpu/webgpu_api.h"

#include <dlfcn.h>

#include "core/text.h"

namespace anchorsplat {

Result<WebGpuApi> LoadWebGpu(const std::string& path) {
  void* const library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    const char* const reason = dlerror();
    return Error{ErrorCode::kNotFound, Cat("the WebGPU library cannot be loaded: ", reason == nullptr ? path : reason)};
  }
  WebGpuApi api;
  std::string missing;
  api.path = path;
#define ANCHORSPLAT_WEBGPU_LOAD(name)                                        \
  api.name = reinterpret_cast<WGPUProc##name>(dlsym(library, "wgpu" #name)); \
  if (api.name == nullptr && missing.empty()) missing = "wgpu" #name;
  ANCHORSPLAT_WEBGPU_FUNCTIONS(ANCHORSPLAT_WEBGPU_LOAD)
#undef ANCHORSPLAT_WEBGPU_LOAD
  if (!missing.empty()) {
    dlclose(library);
    return Error{ErrorCode::kNotFound, Cat(path, " is no WebGPU library: it has no function ", missing)};
  }
  const auto optional = [&](auto& function, const char* name) {
    function = reinterpret_cast<std::decay_t<decltype(function)>>(dlsym(library, name));
  };
  optional(api.DevicePoll, "wgpuDevicePoll");
  optional(api.InstanceEnumerateAdapters, "wgpuInstanceEnumerateAdapters");
  if (api.DevicePoll == nullptr) {
    optional(api.InstanceWaitAny, "wgpuInstanceWaitAny");
    optional(api.HasInstanceFeature, "wgpuHasInstanceFeature");
  }
  return api;
}

}  // namespace anchorsplat
