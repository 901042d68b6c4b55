#pragma once

#include <ostream>
#include <vector>

#include "edit/edit_plan.h"

namespace anchorsplat {

// A line per edit that removes Gaussians, with the numbers removed and left.
void PrintSteps(const std::vector<EditStep>& steps, std::ostream& out);

}  // namespace anchorsplat
