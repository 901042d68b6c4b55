#pragma once

#include <cstdint>

#include "core/buffer.h"
#include "core/cloud_view.h"

namespace anchorsplat {

// A palette of SH vectors (all coefficients of a Gaussian beyond degree 0).
struct ShPalette {
  int64_t entries = 0;
  Buffer<float> centroids;  // [entries, 3·((degree+1)² − 1)], coefficient-major as in a cloud
  Buffer<uint16_t> labels;  // [N] entry per Gaussian
};

// Builds at most `entries` (1–65,536) centroids with a small sum of squared distances, in O(N log entries) instead of
// plain k-means' O(N · entries). The set is repeatedly split at its mean along its main direction, the part with the
// largest sum of squares first (Linde, Buzo & Gray 1980, with the greedy order of Wu 1992). Then `iterations` rounds of
// k-means refine it, in which a vector chooses among the 256 centroids of its branch of the tree (4,096 in small sets).
// Vectors are compared as 12-bit integers within ±64 standard deviations, so the result is the same on every machine;
// NaN counts as 0. Needs about 16 bytes per Gaussian. The cloud must have degree 1–3 and at least one Gaussian.
ShPalette BuildShPalette(const CloudView& cloud, int64_t entries, int iterations);

}  // namespace anchorsplat
