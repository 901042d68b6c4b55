#pragma once

#include <nlohmann/json_fwd.hpp>

#include "model/network_findings.h"
#include "reading/splat_findings.h"

namespace anchorsplat {

// Findings of `info` as JSON.
nlohmann::json ToJson(const SplatFindings& findings);
nlohmann::json ToJson(const Reading& reading);
nlohmann::json ToJson(const NetworkFindings& findings);

}  // namespace anchorsplat
