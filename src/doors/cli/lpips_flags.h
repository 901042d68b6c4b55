#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "core/result.h"
#include "perceptual/lpips.h"

namespace anchorsplat {

// --lpips NET and --lpips-weights DIR. NET may be "if-there": alex, and none where it is missing.
void AddLpipsFlags(CLI::App& verb, std::string& net, std::string& folder);

// The metric, or nothing: not asked for (`net` empty), or missing and asked for only if there, which is a warning. An
// empty `folder` is LpipsFolder(). Errors: kNotFound where it is missing; weights that are there and broken.
Result<std::optional<Lpips>> OpenLpips(const std::string& net, const std::string& folder);

}  // namespace anchorsplat
