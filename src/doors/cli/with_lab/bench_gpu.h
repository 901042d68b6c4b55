#pragma once

#include "cli/verb.h"

namespace anchorsplat {

// `bench gpu`: what a GPU takes for pictures and their gradients, how near they are to the CPU's, and what that takes
// (docs/gpu.md).
void AddGpuBench(CLI::App& bench, Program& program);

}  // namespace anchorsplat
