#pragma once

#include <cstdint>

namespace anchorsplat {

// Finds the nearest of `entries` (1–65,536) centroids for each of `count` points; ties go to the first. Vectors are
// rows of `width` int16 (a multiple of 16) within ±2047, so that sums of squares fit 32 bits.
void NearestCentroids(const int16_t* points, int64_t count, const int16_t* centroids, int64_t entries, int64_t width,
                      uint16_t* nearest);

}  // namespace anchorsplat
