#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/device_choice.h"
#include "core/result.h"
#include "gpu/device.h"

namespace anchorsplat {

// The WebGPU library, searched for at run time; nothing is linked (docs/gpu.md lists the places).
struct GpuLibrary {
  std::string path;     // of the loaded library; empty: none
  std::string problem;  // why there is none and what to do, in one sentence; empty: loaded
  bool named = false;   // set by ANCHORSPLAT_WEBGPU, which disables the search
};
GpuLibrary FindGpuLibrary();

// Folder of a loaded module (such as Python's), also searched for the library. Call it before the first search.
void SetGpuLibraryHint(const std::filesystem::path& module_folder);

// All adapters, in a stable order; empty without a library.
std::vector<GpuAdapter> ListGpuAdapters();

// Opens a device. kGpu takes the first usable adapter, real GPUs before type CPU; kAuto never takes type CPU. Null
// backends are excluded. Devices stay open and are shared: a second call for the same adapter returns the same device
// unless it is lost. Errors (kNotFound): no library, no adapter, no such number, or the driver's reason.
Result<std::shared_ptr<GpuDevice>> OpenGpu(const DeviceChoice& choice);
// Opens a separate device without the library's bounds checks in kernels, to measure their cost. A kernel that reads
// out of bounds has undefined behaviour. Errors: those of OpenGpu; not supported by the library.
Result<std::shared_ptr<GpuDevice>> OpenUncheckedGpu(const DeviceChoice& choice);

// The device of this thread's run (RunContext::device), opened on first use; null: use the CPU. A failure to open is an
// error for kGpu and kNumber, and null for kAuto. Null after GiveUpGpu.
Result<std::shared_ptr<GpuDevice>> GpuOfRun();

// Switches the run to the CPU; the first call warns with the reason.
void GiveUpGpu(const Error& reason);
std::string WhyGpuWasGivenUp();  // reason in this thread's run; empty: not given up

}  // namespace anchorsplat
