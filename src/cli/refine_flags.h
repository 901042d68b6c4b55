#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "enhance/refine_options.h"

namespace anchorsplat {

// The options of refinement, into `options`; `resume` and `checkpoint` into `control`.
void AddRefineFlags(CLI::App& verb, RefineOptions& options, RefineControl& control);

}  // namespace anchorsplat
