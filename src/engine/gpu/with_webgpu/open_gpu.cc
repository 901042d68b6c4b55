#include "gpu/open_gpu.h"

#include <cstdlib>
#include <map>
#include <mutex>

#include "core/text.h"
#include "gpu/choose_adapter.h"
#include "gpu/with_webgpu/webgpu_device.h"
#include "gpu/with_webgpu/webgpu_instance.h"

namespace anchorsplat {

namespace {

// Never destroyed: work may still run when the program ends.
struct OpenDevices {
  std::mutex mutex;
  std::map<int, std::shared_ptr<WebGpuDevice>> by_adapter, unchecked_by_adapter;
  std::vector<std::shared_ptr<WebGpuDevice>> failed;  // the library may still call back about them
  std::vector<GpuAdapter> adapters;                   // as found; empty: not searched yet
};

OpenDevices& Devices() {
  static OpenDevices& devices = *new OpenDevices;
  return devices;
}

constexpr const char* kBroken = "the WebGPU library stopped when a device was lost; a new start of the program helps";

}  // namespace

GpuLibrary FindGpuLibrary() {
  const WebGpuInstance& instance = WebGpuInstance::OfProcess();
  const char* const named = std::getenv("ANCHORSPLAT_WEBGPU");
  return {.path = instance.api() == nullptr ? "" : instance.api()->path,
          .problem = instance.problem(),
          .named = named != nullptr && *named != '\0'};
}

void SetGpuLibraryHint(const std::filesystem::path& module_folder) { WebGpuInstance::SetModuleFolder(module_folder); }

std::vector<GpuAdapter> ListGpuAdapters() {
  const std::lock_guard lock(Devices().mutex);
  std::vector<GpuAdapter> adapters;
  for (const FoundAdapter& found : WebGpuInstance::OfProcess().Adapters()) adapters.push_back(found.description);
  return adapters;
}

namespace {

Result<std::shared_ptr<GpuDevice>> Open(const DeviceChoice& choice, bool unchecked) {
  WebGpuInstance& instance = WebGpuInstance::OfProcess();
  if (instance.api() == nullptr) return Error{ErrorCode::kNotFound, instance.problem()};
  if (unchecked && instance.api()->DeviceCreateShaderModuleTrusted == nullptr) {
    return Error{ErrorCode::kNotFound, Cat(instance.api()->path, " compiles no kernel without checks at run time")};
  }
  OpenDevices& devices = Devices();
  const std::lock_guard lock(devices.mutex);
  if (instance.broken()) return Error{ErrorCode::kNotFound, kBroken};
  std::vector<FoundAdapter> found;
  if (devices.adapters.empty()) {
    found = instance.Adapters();
    for (const FoundAdapter& adapter : found) devices.adapters.push_back(adapter.description);
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t index, ChooseAdapter(devices.adapters, choice));
  auto& by_adapter = unchecked ? devices.unchecked_by_adapter : devices.by_adapter;
  std::shared_ptr<WebGpuDevice>& kept = by_adapter[static_cast<int>(index)];
  if (kept && !kept->failed()) return std::shared_ptr<GpuDevice>(kept);
  if (kept) devices.failed.push_back(std::move(kept));
  // In Dawn, an adapter gives only one device, so find it again.
  if (found.empty()) found = instance.Adapters();
  if (index >= found.size()) return Error{ErrorCode::kNotFound, "the GPU is gone"};
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::shared_ptr<WebGpuDevice> opened,
                               WebGpuDevice::Open(instance, found[index], unchecked));
  kept = std::move(opened);
  return std::shared_ptr<GpuDevice>(kept);
}

}  // namespace

Result<std::shared_ptr<GpuDevice>> OpenGpu(const DeviceChoice& choice) { return Open(choice, false); }

Result<std::shared_ptr<GpuDevice>> OpenUncheckedGpu(const DeviceChoice& choice) { return Open(choice, true); }

}  // namespace anchorsplat
