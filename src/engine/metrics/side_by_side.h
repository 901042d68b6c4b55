#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

struct LabelledImage {
  std::string label;   // first line of the caption, e.g. "before"
  std::string detail;  // second line, dimmer, e.g. "28.65 dB  0.961"; may be empty
  const Image* image = nullptr;
};

// A region of the views, in view pixels.
struct ViewRegion {
  int x = 0, y = 0, width = 0, height = 0;

  PixelBox box() const { return {x, y, x + width, y + height}; }
};

struct SideBySideOptions {
  double crop = 0.2;                                // width of the enlarged region relative to the view, in (0, 1]
  std::optional<ViewRegion> region = std::nullopt;  // the enlarged region; default: MostDifferentRegion
  bool differences = true;                          // add a row of difference maps
  float gain = 4;                                   // the brightest colour of the maps is a difference of 1 / gain
  std::vector<std::string> credits = {};            // attributions, each on its own lines at the bottom
};

// The region of the given size with the largest sum of absolute differences between `a` and `b`; if they are equal, the
// one with most detail in `b` (sum of absolute steps between neighbours). Ties: first in reading order.
ViewRegion MostDifferentRegion(const Image& a, const Image& b, int width, int height);

// A comparison chart with a column per image, the last of which is the reference (ground truth, or the compared image).
// A column has a caption, the view with the enlarged region framed, that region at an integer zoom, and a heat map of
// the absolute difference to the reference (for the reference, the colour scale). Views above 640 x 960 are shrunk,
// tiny ones enlarged; the enlarged region shows every original pixel unless a larger one was requested.
//
// Accepts 1, 3 or 4 channels, ignores alpha, and clamps values to 0–1. kBadArgument: no images, different or empty
// sizes, a region outside the view, gain or crop out of range.
Result<Image> SideBySide(std::span<const LabelledImage> images, const SideBySideOptions& options = {});

}  // namespace anchorsplat
