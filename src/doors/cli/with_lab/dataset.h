#pragma once

#include <CLI/CLI.hpp>

#include "cli/verb.h"

namespace anchorsplat {

// The verbs below `dataset` that make objects.
void AddDatasetBuild(CLI::App& parent, Program& program);
void AddDatasetObject(CLI::App& parent, Program& program);
void AddDatasetRoom(CLI::App& parent, Program& program);

}  // namespace anchorsplat
