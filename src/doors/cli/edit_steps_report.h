#pragma once

#include <ostream>
#include <vector>

#include "edit/edit_plan.h"

namespace anchorsplat {

// A line for each edit that takes Gaussians away: how many, and how many are left.
void PrintSteps(const std::vector<EditStep>& steps, std::ostream& out);

}  // namespace anchorsplat
