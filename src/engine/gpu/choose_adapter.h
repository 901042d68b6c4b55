#pragma once

#include <vector>

#include "core/device_choice.h"
#include "core/result.h"
#include "gpu/device.h"

namespace anchorsplat {

// Index in `adapters` (in the order of ListGpuAdapters) of the adapter that `choice` selects by the rules of OpenGpu.
// kNotFound: none.
Result<size_t> ChooseAdapter(const std::vector<GpuAdapter>& adapters, const DeviceChoice& choice);

}  // namespace anchorsplat
