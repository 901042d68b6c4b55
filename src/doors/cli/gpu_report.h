#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "gpu/device.h"
#include "gpu/open_gpu.h"

namespace anchorsplat {

// What `doctor` finds of GPUs.
struct GpuFindings {
  GpuLibrary library;
  std::vector<GpuAdapter> adapters;

  bool ready() const;                                                    // --device gpu has something to take
  bool broken() const { return library.named && library.path.empty(); }  // the library that was named cannot be used
};
GpuFindings LookForGpus();

// What a verb says that works on it.
std::string WorkingOn(const GpuAdapter& adapter);

// Why --device auto does not take an adapter, as a sentence's end; empty: it does.
std::string WhyNotTaken(const GpuAdapter& adapter);

// Of each adapter what it is and why it is not taken; a line that says what is missing where there are none.
std::vector<std::string> LinesOf(const GpuFindings& findings);
// How to get what is missing; empty: nothing is.
std::string CommandFor(const GpuFindings& findings);
nlohmann::json ToJson(const GpuFindings& findings);

}  // namespace anchorsplat
