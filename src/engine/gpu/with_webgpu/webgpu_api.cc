#include "gpu/with_webgpu/webgpu_api.h"

#include <dlfcn.h>
#include <elf.h>

#include <cstring>
#include <fstream>
#include <vector>

#include "core/text.h"

namespace anchorsplat {

namespace {

// Whether the file is shorter than the segments in its header. The system's loader maps it unchecked, and the process
// would crash on the first missing page.
bool IsCutShort(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const auto size = file ? static_cast<uint64_t>(file.tellg()) : 0;
  Elf64_Ehdr header;
  file.seekg(0);
  if (size < sizeof(header) || !file.read(reinterpret_cast<char*>(&header), sizeof(header))) return false;
  if (std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0 || header.e_ident[EI_CLASS] != ELFCLASS64) return false;
  std::vector<Elf64_Phdr> segments(header.e_phnum);
  const uint64_t bytes = segments.size() * sizeof(Elf64_Phdr);
  if (header.e_phentsize != sizeof(Elf64_Phdr) || header.e_phoff > size || bytes > size - header.e_phoff) return true;
  file.seekg(static_cast<std::streamoff>(header.e_phoff));
  if (!file.read(reinterpret_cast<char*>(segments.data()), static_cast<std::streamsize>(bytes))) return true;
  for (const Elf64_Phdr& segment : segments) {
    if (segment.p_type != PT_LOAD) continue;
    if (segment.p_offset > size || segment.p_filesz > size - segment.p_offset) return true;
  }
  return false;
}

}  // namespace

Result<WebGpuApi> LoadWebGpu(const std::string& path) {
  if (IsCutShort(path)) {
    return Error{ErrorCode::kNotFound, Cat("the WebGPU library ", path, " is cut short: get it again")};
  }
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
  optional(api.DeviceCreateQuerySet, "wgpuDeviceCreateQuerySet");
  optional(api.CommandEncoderResolveQuerySet, "wgpuCommandEncoderResolveQuerySet");
  optional(api.QueueGetTimestampPeriod, "wgpuQueueGetTimestampPeriod");
  optional(api.DeviceCreateShaderModuleTrusted, "wgpuDeviceCreateShaderModuleTrusted");
  if (api.DevicePoll == nullptr) {
    optional(api.InstanceWaitAny, "wgpuInstanceWaitAny");
    optional(api.HasInstanceFeature, "wgpuHasInstanceFeature");
  }
  return api;
}

}  // namespace anchorsplat
