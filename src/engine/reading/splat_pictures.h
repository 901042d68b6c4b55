#pragma once

#include <array>
#include <vector>

#include "core/result.h"
#include "reading/outline_profile.h"
#include "reading/showing_gaussians.h"

namespace anchorsplat {

// What pictures of a splat show of the pixels that it was fitted to, from all sides.
//
// A fit reproduces outlines as its training pixels saw them, where alpha rises over about one pixel. Drawn with the
// dilation of the pixels it was fitted with it shows them so; with smaller ones they are sharper, but by less than the
// pixel is smaller, as a fit cannot take back more than all of the dilation. In units of the size that is tried their
// width thus falls while the size grows, and says where it equals the pixel. Where there are no outlines, in a room or
// on land, the detail of colours does: below its pixels a fit shows what no picture had.
struct SplatPictures {
  // Octaves around the unit at which outlines are looked at.
  static constexpr int kOctaves = 3;
  static constexpr size_t kSizes = 2 * kOctaves + 1;
  // Details of colours from a quarter of the unit on, an octave each.
  static constexpr size_t kDetails = 7;

  struct AtSize {
    std::array<double, kOutlineValues> classic{};      // OutlineProfile::Values
    std::array<double, kOutlineValues> antialiased{};  // at odd places only
    double cut = 0, coarse = 0;                        // shares of outlines that are left out (OutlineProfile)
  };
  std::array<AtSize, kSizes> sizes;
  // ln of the mean square of Haar details of luminance over black, then of alpha, each over the mean square of all.
  std::array<double, kDetails> of_luminance{}, of_alpha{};
};

// `unit`: world length that sizes are counted from. Errors: of rendering.
Result<SplatPictures> LookAt(const TellingGaussians& telling, double unit);
// Of what nobody looks at: all NaN.
SplatPictures UnknownPictures();

}  // namespace anchorsplat
