#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "enhance/refine_options.h"

namespace anchorsplat {

inline constexpr const char* kRefineGroup = "Refinement";

// Adds the options of refinement in the group kRefineGroup; `resume` and `checkpoint` go into `control`.
void AddRefineFlags(CLI::App& verb, RefineOptions& options, RefineControl& control);

}  // namespace anchorsplat
