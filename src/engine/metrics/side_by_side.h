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

// A part of the views, in their pixels.
struct ViewRegion {
  int x = 0, y = 0, width = 0, height = 0;

  PixelBox box() const { return {x, y, x + width, y + height}; }
};

struct SideBySideOptions {
  double crop = 0.2;  // width of the enlarged part as a fraction of the view's, in (0, 1]
  std::optional<ViewRegion> region =
      std::nullopt;                       // the part itself; chosen by MostDifferentRegion where it is not given
  bool differences = true;                // the row of difference maps
  float gain = 4;                         // their brightest colour stands for a difference of 1 / gain
  std::vector<std::string> credits = {};  // below all: whose the things shown are, each on lines of its own
};

// The region of the given size where `a` and `b` differ most (sum of absolute differences); where they are equal, the
// one of `b` with most detail (sum of absolute steps between neighbours). The first in reading order among equals.
ViewRegion MostDifferentRegion(const Image& a, const Image& b, int width, int height);

// A picture for people: a column per image, the last one the reference (ground truth, or the thing compared with).
// Each column has its caption, the view with the enlarged part framed, that part in whole multiples of its pixels, and
// the absolute difference to the reference as a heat map (under the reference, its scale). Views of more than 640 x 960
// are shown smaller, tiny ones larger; the enlarged part shows every original pixel unless a larger one was asked for.
//
// Takes 1 or 3 channels, or 4 of which the alpha is ignored; values are clamped to 0–1. kBadArgument: no images,
// different or empty sizes, a region that is not inside the view, gain or crop out of range.
Result<Image> SideBySide(std::span<const LabelledImage> images, const SideBySideOptions& options = {});

}  // namespace anchorsplat
