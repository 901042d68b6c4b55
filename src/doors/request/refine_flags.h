#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "enhance/refine_options.h"

namespace anchorsplat {

inline constexpr const char* kRefineGroup = "Refinement";

// The options of refinement, as the group kRefineGroup, into `options`; `resume` and `checkpoint` into `control`.
void AddRefineFlags(CLI::App& verb, RefineOptions& options, RefineControl& control);

}  // namespace anchorsplat
