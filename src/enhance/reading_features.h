#pragma once

#include <string>
#include <vector>

#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// What a splat shows of how it was made, how large its training pixels were and what has become of it since: all that
// enhance looks at before it decides, and what else may tell. One row of numbers, none of which depends on the unit.
//
// Lengths are ln(length / unit), `unit` the size of the small Gaussians (PixelSizeProbe::start), within a factor of
// three of the training pixel for most fits. What is asked at pixels of a size is asked at unit · 2^(k/2), |k| ≤ 7:
// names end in [k]. NaN: there is nothing to tell it by (too few Gaussians, no harmonics, no axis that is finite).
//
//   file.*       what the file says: mode (one of three or none), marks of this program, SH degree
//   count.*      ln of the numbers of Gaussians, shares that show, that are nearly black, of the largest thing
//   size.*       SizeFeatures (enhance/pixel_size_features.h); deciles of opacity
//   axis*        quantiles of the smallest, middle and largest axis, each Gaussian alike; shares that have one value
//   color.*, turn.*   colours that no picture has, harmonics over constant colours, mean of | |quaternion| − 1 |
//   tail.*       SizeTails (enhance/trained_kind.h)
//   twin.*       EnhancedLook (enhance/enhanced_look.h) and what else tells what networks leave
//   surface.*    PixelSizeEvidence (enhance/pixel_size_guard.h), CloudShape, TwoSides
//   alpha[k].*   outline profile (enhance/outline_profile.h) as the classic rasterizer draws alpha
//   thin[k].*    the same as the antialiased one does
//   bright[k].*  how much alpha's changes without black Gaussians; 0 where these are few
//   left[k].*    shares of the outlines that cuts and coarse Gaussians make
//   closer[k].*  DownscaleLook (enhance/downscale_look.h) of classic, then of antialiased pictures
struct ReadingFeatures {
  double unit = 0;                 // world units
  std::vector<std::string> names;  // the same of every splat
  std::vector<double> values;
};

// kBadArgument: fewer than kLeastGaussians that show (enhance/pixel_size_features.h); others of rendering.
Result<ReadingFeatures> ReadFeatures(const GaussianCloud& cloud);

}  // namespace anchorsplat
