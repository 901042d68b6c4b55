#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/gaussian_cloud.h"

namespace anchorsplat {

// The `count` of `rows` with the largest opacity × product of the two largest scales, in the order of `rows`. Ties
// prefer the earlier row; rows that are not drawn (IsDrawn) come last.
std::vector<int64_t> MostVisible(const GaussianCloud& cloud, std::span<const int64_t> rows, int64_t count);
// The same for all rows.
std::vector<int64_t> MostVisible(const GaussianCloud& cloud, int64_t count);

}  // namespace anchorsplat
