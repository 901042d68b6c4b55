#pragma once

#include <cstdint>
#include <vector>

#include "core/gaussian_cloud.h"

namespace anchorsplat {

struct EnhanceOptions;

// Sets the limit of the result and of the methods' own options.
void SetBudget(EnhanceOptions& options, int64_t max_gaussians);

// Removes the rows with keep[i] = 0.
void KeepMarked(const std::vector<char>& keep, GaussianCloud& cloud);

// Keeps the `most` Gaussians with the largest opacity × size, in order, and warns. Returns how many were dropped. 0
// means no limit.
int64_t DropLeastVisible(int64_t most, GaussianCloud& cloud);

}  // namespace anchorsplat
