#pragma once

#include <CLI/CLI.hpp>

#include "formats/cloud_io.h"

namespace anchorsplat {

// How a splat goes into a file: --sort and --spz-version, the option that is returned.
CLI::Option* AddWriteFlags(CLI::App& verb, CloudWriteOptions& write);

}  // namespace anchorsplat
