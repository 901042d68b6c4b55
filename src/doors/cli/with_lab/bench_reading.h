#pragma once

#include "cli/verb.h"

namespace anchorsplat {

// `bench reading`: what a splat shows before it is enhanced, the table that learns from it, and the board on which
// whoever decides is measured (docs/reading.md).
void AddReadingBench(CLI::App& bench, Program& program);

}  // namespace anchorsplat
