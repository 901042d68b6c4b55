#pragma once

#include <array>
#include <vector>

#include "core/result.h"
#include "reading/outline_profile.h"
#include "reading/visible_gaussians.h"

namespace anchorsplat {

// Estimates the training pixel size from rendered views all around the splat.
//
// A fit reproduces outlines as its training pixels saw them: alpha rises over about one pixel. Rendered at that pixel
// size, outlines have that width. Rendered at smaller pixels they get sharper, but less than in proportion, because a
// fit cannot remove more than the whole dilation. So their width in rendered pixels decreases with growing pixel size,
// and where it equals one pixel is the training pixel. Where there are no outlines, as in rooms and landscapes, colour
// detail serves: below its training pixel a fit shows detail that no picture had.
struct SplatPictures {
  // Octaves on either side of the unit at which outlines are measured.
  static constexpr int kOctaves = 3;
  static constexpr size_t kSizes = 2 * kOctaves + 1;
  // Octaves of colour detail, from a quarter of the unit.
  static constexpr size_t kDetails = 7;

  struct AtSize {
    std::array<double, kOutlineValues> classic{};      // OutlineProfile::Values
    std::array<double, kOutlineValues> antialiased{};  // filled for odd indices only
    double cut = 0, coarse = 0;                        // excluded shares of outlines (OutlineProfile)
  };
  std::array<AtSize, kSizes> sizes;
  // ln of the mean square of Haar details of luminance on black, then of alpha, each relative to that of all details.
  std::array<double, kDetails> of_luminance{}, of_alpha{};
};

// Renders and measures. `unit`: reference world length. Errors: those of rendering.
Result<SplatPictures> MeasurePictures(const CentralGaussians& central, double unit);
// Placeholder when no pictures are rendered: all NaN.
SplatPictures UnknownPictures();

}  // namespace anchorsplat
