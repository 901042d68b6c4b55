#pragma once

#include <CLI/CLI.hpp>

#include "formats/cloud_io.h"

namespace anchorsplat {

// Adds --sort and --spz-version; returns the latter.
CLI::Option* AddWriteFlags(CLI::App& verb, CloudWriteOptions& write);

}  // namespace anchorsplat
