#pragma once

#include <array>

#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// An affine map of colours: c' = matrix·c + offset.
struct ColorMap {
  std::array<double, 9> matrix = {1, 0, 0, 0, 1, 0, 0, 0, 1};  // row-major, rgb to rgb
  std::array<double, 3> offset = {0, 0, 0};
};

// The affine map that brings the colours of `image` nearest to those of `truth`, by least squares over all pixels: what
// a camera's exposure and white balance, or the light, may have changed between two pictures of the same thing. Both
// have three channels or more, of which three count, in 0–1.
//
// Colours that do not vary in some direction (grey pictures, a single colour) determine no map: in that direction it is
// the identity about the mean. A small ridge sees to that, well below the rounding of eight bits, so that the map never
// fits worse than a mere shift of the mean, and thus never worse than none. The identity where values are not finite.
// Deterministic for any number of threads. kBadArgument: sizes or channels differ, fewer than three channels, no pixel.
Result<ColorMap> FitColors(const Image& image, const Image& truth);

// `image` mapped, each value within 0–1; channels beyond the third stay.
void ApplyColors(const ColorMap& map, Image& image);

}  // namespace anchorsplat
