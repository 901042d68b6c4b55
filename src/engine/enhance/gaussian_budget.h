#pragma once

#include <cstdint>
#include <vector>

#include "core/gaussian_cloud.h"

namespace anchorsplat {

struct EnhanceOptions;

// The bound of the result and of the methods' own options, which are one.
void SetBudget(EnhanceOptions& options, int64_t max_gaussians);

// Closes up the rows for which keep[i] is set.
void KeepMarked(const std::vector<char>& keep, GaussianCloud& cloud);

// Leaves the `most` of the largest opacity × size, in their order, with a warning. How many are gone; none where `most`
// is 0, which is no bound.
int64_t LeaveOutLeastVisible(int64_t most, GaussianCloud& cloud);

}  // namespace anchorsplat
