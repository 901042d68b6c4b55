#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "gpu/device.h"
#include "gpu/open_gpu.h"

namespace anchorsplat {

// GPU findings of `doctor`.
struct GpuFindings {
  GpuLibrary library;
  std::vector<GpuAdapter> adapters;

  bool ready() const;                                                    // --device gpu has something to take
  bool broken() const { return library.named && library.path.empty(); }  // the library that was named cannot be used
};
GpuFindings LookForGpus();

// Message of a verb that uses the adapter.
std::string WorkingOn(const GpuAdapter& adapter);

// Why --device auto does not choose an adapter; empty: it may.
std::string WhyNotTaken(const GpuAdapter& adapter);

// Each adapter, with the reason if it is not usable; or what is missing if there is none.
std::vector<std::string> LinesOf(const GpuFindings& findings);
// Command that gets what is missing; empty: nothing is missing.
std::string CommandFor(const GpuFindings& findings);
nlohmann::json ToJson(const GpuFindings& findings);

}  // namespace anchorsplat
