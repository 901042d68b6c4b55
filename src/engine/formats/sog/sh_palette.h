#pragma once

#include <cstdint>

#include "core/buffer.h"
#include "core/cloud_view.h"

namespace anchorsplat {

// SH vectors (all coefficients beyond degree 0 of a Gaussian) that stand for those of all Gaussians.
struct ShPalette {
  int64_t entries = 0;
  Buffer<float> centroids;  // [entries, 3·((degree+1)² − 1)], coefficient-major as in a cloud
  Buffer<uint16_t> labels;  // [N] entry of each Gaussian
};

// At most `entries` (1–65,536) centroids that keep the sum of squared distances small, in time O(N log entries) and not
// O(N · entries) as plain k-means: the set is split at its mean along its main direction, always the part with the
// largest sum of squares next (Linde, Buzo & Gray 1980, with the greedy order of Wu 1992); then `iterations` rounds of
// k-means improve the result, in which a vector may choose among the 256 centroids of its branch of the tree (4,096 in
// small sets). Vectors are compared in 12-bit integers over ±64 standard deviations at most, so the result is the same
// everywhere; NaN counts as 0. Takes about 16 bytes per Gaussian. The cloud has degree 1–3 and at least one Gaussian.
ShPalette BuildShPalette(const CloudView& cloud, int64_t entries, int iterations);

}  // namespace anchorsplat
