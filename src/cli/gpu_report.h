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

  bool ready() const;  // --device gpu has something to take
};
GpuFindings LookForGpus();

// Why --device auto does not take an adapter, as a sentence's end; empty: it does.
std::string WhyNotTaken(const GpuAdapter& adapter);

// Of each adapter what it is and why it is not taken; a line that says what is missing where there are none.
std::vector<std::string> LinesOf(const GpuFindings& findings);
// How to get what is missing; empty: nothing is.
std::string CommandFor(const GpuFindings& findings);
nlohmann::json ToJson(const GpuFindings& findings);

}  // namespace anchorsplat
