#pragma once

#include <cstdint>
#include <span>

#include "core/buffer.h"
#include "core/cloud_view.h"

namespace anchorsplat {

// Whether the values of a splat look like what some programs store instead of logarithms, logits and harmonics. All of
// these say yes only where the other reading is next to impossible: splats of any unit and kind are not to be
// suspected.

// Some Gaussians of a splat, spread over all of it.
struct StoredSample {
  int64_t of = 0;           // how many there are
  Buffer<float> means;      // [n,3]
  Buffer<float> scales;     // [n,3] as stored
  Buffer<float> opacities;  // [n] as stored
  Buffer<float> colors;     // [n,3] f_dc

  static constexpr int64_t kMost = 1 << 14;
  // Every so many-th of `of` rows is in it.
  static int64_t StepOf(int64_t of) { return of / kMost + 1; }
  void Add(const CloudView& rows, int64_t row);  // not if it is not usable
};
StoredSample SampleOf(const CloudView& cloud);

// Lengths, which are never negative. Logarithms that are not, of a splat in large units, have hardly any values just
// above zero, where those of thin Gaussians lie; nor are all Gaussians longer than the splat, or many times longer than
// the way to the next one, where the same numbers taken for lengths are about as long as that.
bool LooksLikeLengths(const StoredSample& sample);
// From 0 to 1: logits in there would be opacities of 50 to 73 % only.
bool LooksLikeOpacities(const StoredSample& sample);
// 1: f_dc are colours from 0 to 1, most of it and nothing beyond; 255: from 0 to 255; 0: neither.
int LooksLikeColors(const StoredSample& sample);

}  // namespace anchorsplat
