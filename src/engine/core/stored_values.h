#pragma once

#include <cstdint>
#include <span>

#include "core/buffer.h"
#include "core/cloud_view.h"

namespace anchorsplat {

// Detects splats that store lengths, opacities and colours instead of logarithms, logits and harmonics. All checks are
// conservative: they say yes only if the other reading is next to impossible, for splats of any unit and kind.

// Evenly spaced rows of a splat.
struct StoredSample {
  int64_t total = 0;        // rows of the splat
  Buffer<float> means;      // [n,3]
  Buffer<float> scales;     // [n,3] as stored
  Buffer<float> opacities;  // [n] as stored
  Buffer<float> colors;     // [n,3] f_dc

  static constexpr int64_t kMaxRows = 1 << 14;
  // Distance between sampled rows of a splat with `total` rows.
  static int64_t Stride(int64_t total) { return total / kMaxRows + 1; }
  void Add(const CloudView& rows, int64_t row);  // skips a row with NaN
};
StoredSample SampleStored(const CloudView& cloud);

// Whether scales are lengths, which are never negative. Logarithms without negative values come from splats in large
// units, and differ in two ways: hardly any lie just above zero, where lengths of thin Gaussians do; and Gaussians are
// not all longer than the splat, nor many times longer than the distance to their neighbour, when the same values read
// as lengths match that distance.
bool LooksLikeLengths(const StoredSample& sample);
// Whether opacities are stored as 0–1: as logits, these would be opacities of only 50 to 73 %.
bool LooksLikeOpacities(const StoredSample& sample);
// 1: f_dc are colours that fill most of 0–1 and nothing beyond; 255: colours in 0–255; 0: neither.
int LooksLikeColors(const StoredSample& sample);

}  // namespace anchorsplat
