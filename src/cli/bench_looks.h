#pragma once

#include "cli/verb.h"

namespace anchorsplat {

// `anchorsplat bench looks`, under the verb `bench`.
void AddLooksBench(CLI::App& bench, Program& program);

}  // namespace anchorsplat
