#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "core/result.h"
#include "perceptual/lpips.h"

namespace anchorsplat {

// --lpips NET and --lpips-weights DIR.
void AddLpipsFlags(CLI::App& verb, std::string& net, std::string& folder);

// The metric, or nothing: not asked for (`net` empty), or missing, which is a warning, because the other metrics do not
// need it. Weights that are there and broken are an error. An empty `folder` is LpipsFolder().
Result<std::optional<Lpips>> OpenLpipsOrWarn(const std::string& net, const std::string& folder);

}  // namespace anchorsplat
