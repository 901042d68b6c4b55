#pragma once

#include <optional>
#include <string>

#include "core/result.h"
#include "perceptual/lpips.h"

namespace anchorsplat {

// Opens the metric for OpenLpipsDistance (cli/lab.h).
Result<std::optional<Lpips>> OpenLpips(const std::string& net, const std::string& folder);

}  // namespace anchorsplat
