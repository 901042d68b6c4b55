#pragma once

#include <string>
#include <vector>

#include "core/cloud_view.h"
#include "core/result.h"
#include "reading/showing_gaussians.h"

namespace anchorsplat {

// What a splat shows of how it was made, how large its training pixels were and what has become of it since: all that
// is looked at before it is enhanced. One row of numbers, none of which depends on the unit.
//
// Lengths are ln(length / unit), `unit` the size of the small Gaussians, within a factor of three of the training pixel
// for most fits. NaN: there is nothing to tell it by (no harmonics, no axis that is finite).
//
//   file.*      what the file says: render mode (one of three or none), SH degree
//   count.*     shares of the Gaussians that show, and of these that are not nearly black
//   size.*      10, 25, 50 and 75 % quantiles of the axes, smallest first, and of opacity, weighted by opacity × area
//   opacity.*   deciles; share that is fainter than 0.3; its mean and the share that is opaque, by fifths of the area
//   axis*       quantiles of the axes, each Gaussian alike; shares that have one value, and that are the least
//   tail.*      how far the smallest 2 and 5 % of an axis lie below their quantile, in the mean
//   color.*     colours that no picture has; harmonics over constant colours
//   turn.*      mean of | |quaternion| − 1 |
//   twin.*      how much the likest of eight neighbours differs: covariance, distance, colour, opacity, turn, harmonics
//   near.*      how far apart Gaussians lie on the surface, of 8 and of 64 neighbours
//   shape.*     thickness and width of the whole over its length
//   outline[k]  SplatPictures at unit · 2^k: classic, antialiased, shares left out
//   detail.*    the same, of colours
struct SplatFeatures {
  double unit = 0;  // world units
  std::vector<double> values;
};

// The names of `values`, the same of every splat.
const std::vector<std::string>& FeatureNames();

// `showing`: FindShowingGaussians(whole). Without pictures, which take nearly all of the time, outline and detail are
// NaN.
// kBadArgument: fewer than kLeastGaussians that show; others of rendering.
Result<SplatFeatures> FeaturesOf(const CloudView& whole, const ShowingGaussians& showing, bool with_pictures = true);
Result<SplatFeatures> FeaturesOf(const CloudView& whole);

}  // namespace anchorsplat
