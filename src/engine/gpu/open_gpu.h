#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/device_choice.h"
#include "core/result.h"
#include "gpu/device.h"

namespace anchorsplat {

// The library that speaks WebGPU is looked for at run time; nothing is linked (docs/gpu.md says where).
struct GpuLibrary {
  std::string path;     // of the library in use; empty: none
  std::string problem;  // one sentence that says why there is none and what to do; empty: there is one
  bool named = false;   // by ANCHORSPLAT_WEBGPU, without which others would be looked for
};
GpuLibrary FindGpuLibrary();

// The folder of a module that stands for the program where that is another's, as Python's: the library is looked for
// around it, too. Counts until the library is looked for first.
void SetGpuLibraryHint(const std::filesystem::path& module_folder);

// All adapters, in an order that does not change from call to call. Empty without a library.
std::vector<GpuAdapter> ListGpuAdapters();

// A device on the adapter that the choice names: kGpu takes the first that can be used, real cards before adapters of
// type CPU; kAuto never takes one of type CPU. Never a null backend. Devices stay open and are shared: a second call
// for the same adapter returns the same one, unless that is lost.
// Errors (kNotFound): no library, no adapter, no such number, or the driver's reason.
Result<std::shared_ptr<GpuDevice>> OpenGpu(const DeviceChoice& choice);
// A device of its own whose kernels are compiled without the checks of the library at run time: for measuring what
// these cost. A kernel that reads beyond a buffer may do anything there. Errors: of OpenGpu; the library knows no such
// thing.
Result<std::shared_ptr<GpuDevice>> OpenUncheckedGpu(const DeviceChoice& choice);

// The device that the run of this thread is to work on (RunContext::device), opened on first use; null: the CPU. What
// cannot be opened is an error where the choice is kGpu or a number, and the CPU where it is kAuto. After GiveUpGpu it
// is null.
Result<std::shared_ptr<GpuDevice>> GpuOfRun();

// From here on the run works on the CPU. Says so in one warning with the reason, the first time.
void GiveUpGpu(const Error& reason);
std::string WhyGpuWasGivenUp();  // by the run of this thread, a sentence; empty: it was not

}  // namespace anchorsplat
