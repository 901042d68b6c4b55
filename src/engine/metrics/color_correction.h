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

// Least-squares affine map from the colours of `image` to those of `truth` over all pixels: models differences in
// exposure, white balance or light between two images of the same scene. Both need at least three channels in 0–1; the
// first three are used.
//
// If colours do not vary in some direction (grey images, a single colour), the map is the identity about the mean in
// that direction. A small ridge, well below 8-bit rounding, ensures that; so the fit is never worse than shifting the
// mean, or than no map. The identity for values that are not finite. Deterministic for any number of threads.
// kBadArgument: sizes or channels differ, fewer than three channels, no pixel.
Result<ColorMap> FitColors(const Image& image, const Image& truth);

// Applies the map and clamps to 0–1; channels beyond the third stay.
void ApplyColors(const ColorMap& map, Image& image);

}  // namespace anchorsplat
