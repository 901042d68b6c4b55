#pragma once

#include "cli/verb.h"

namespace anchorsplat {

// `anchorsplat bench pixel-size`, under the verb `bench`.
void AddPixelSizeBench(CLI::App& bench, Program& program);

}  // namespace anchorsplat
