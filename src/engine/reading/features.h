#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/cloud_view.h"
#include "core/result.h"
#include "reading/visible_gaussians.h"

namespace anchorsplat {

// Features from which a splat's provenance and training pixel size are predicted. Independent of the unit of length.
//
// Lengths are ln(length / unit). `unit` is the size of the small Gaussians, for most fits within a factor of three of
// the training pixel. A whole splat's is the median over its places: by area, walls and ground that few cameras saw
// would outweigh the subject of a capture. NaN: not available (no harmonics, no finite axis).
//
//   file.*      from the file: render mode (one of three or none), SH degree
//   count.*     share of visible Gaussians, and of these that are not nearly black
//   size.*      10, 25, 50 and 75 % quantiles of axes, smallest first, and of opacity, weighted by opacity × area
//   opacity.*   deciles; share below 0.3; its mean and the opaque share, per fifth of the area
//   axis*       unweighted quantiles of the axes; share at the most common value, share at the minimum
//   tail.*      mean distance of the smallest 2 and 5 % of an axis below their quantile
//   color.*     colours that no picture has; harmonics relative to constant colours
//   turn.*      mean of | |quaternion| − 1 |
//   twin.*      difference to the most similar of eight neighbours: covariance, distance, colour, opacity, rotation,
//               harmonics
//   near.*      spacing of Gaussians on the surface, from 8 and from 64 neighbours
//   shape.*     thickness and width of the whole over its length
//   outline[k]  SplatPictures at unit · 2^k: classic, antialiased, excluded shares
//   detail.*    SplatPictures: detail of luminance and alpha
struct SplatFeatures {
  double unit = 0;  // world units
  std::vector<double> values;
  std::vector<SplatFeatures> places;  // of the places of a whole splat (reading/places.h) that can be measured
};

// Names of `values`, the same for every splat.
const std::vector<std::string>& FeatureNames();

// Computes features. `visible`: FindVisibleGaussians(whole). Pictures take most of the time.
// Errors: kBadArgument if fewer than kMinGaussians are visible; those of rendering.
Result<SplatFeatures> FeaturesOf(const CloudView& whole, const VisibleGaussians& visible);
Result<SplatFeatures> FeaturesOf(const CloudView& whole);

// Features of one place: these rows alone, without pictures, so outline and detail are NaN. Errors: as FeaturesOf.
Result<SplatFeatures> FeaturesOfPlace(const CloudView& whole, std::span<const int64_t> rows);

}  // namespace anchorsplat
