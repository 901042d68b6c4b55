#pragma once

#include <vector>

#include "core/device_choice.h"
#include "core/result.h"
#include "gpu/device.h"

namespace anchorsplat {

// Index in `adapters`, which are as ListGpuAdapters gives them, of the one that the choice names (OpenGpu says how).
// Errors (kNotFound): there is none.
Result<size_t> ChooseAdapter(const std::vector<GpuAdapter>& adapters, const DeviceChoice& choice);

}  // namespace anchorsplat
