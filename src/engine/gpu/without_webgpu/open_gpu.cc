#include "gpu/open_gpu.h"

namespace anchorsplat {

namespace {
constexpr const char* kProblem = "this build has no WebGPU: scripts/fetch-webgpu.sh fetches what building it takes";
}

GpuLibrary FindGpuLibrary() { return {.path = "", .problem = kProblem}; }

void SetGpuLibraryHint(const std::filesystem::path& /*module_folder*/) {}

std::vector<GpuAdapter> ListGpuAdapters() { return {}; }

Result<std::shared_ptr<GpuDevice>> OpenGpu(const DeviceChoice& /*choice*/) {
  return Error{ErrorCode::kNotFound, kProblem};
}

Result<std::shared_ptr<GpuDevice>> OpenUncheckedGpu(const DeviceChoice& choice) { return OpenGpu(choice); }

}  // namespace anchorsplat
