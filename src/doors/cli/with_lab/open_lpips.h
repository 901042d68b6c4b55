#pragma once

#include <optional>
#include <string>

#include "core/result.h"
#include "perceptual/lpips.h"

namespace anchorsplat {

// The metric as OpenLpipsDistance (cli/lab.h) opens it.
Result<std::optional<Lpips>> OpenLpips(const std::string& net, const std::string& folder);

}  // namespace anchorsplat
