#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/cloud_view.h"
#include "core/result.h"
#include "reading/features.h"
#include "reading/reading_model.h"
#include "reading/visible_gaussians.h"

namespace anchorsplat {

// How much more a lost decibel counts than a gained one (score: gain - kLossWeight x loss), chosen so that at most
// about 2 % of splats lose 0.1 dB (docs/reading.md).
inline constexpr double kLossWeight = 4;
// Likewise of wrongly taking a splat for finished against the opposite.
inline constexpr double kFinishedWeight = 8;

// What a splat reveals about itself: its provenance, its training pixel size, and what would improve it. Predicted by a
// model trained on splats with known answers (docs/reading.md).
struct Reading {
  double pixel = 0;          // training pixel at the subject, world units
  double low = 0, high = 0;  // 80 % interval of `pixel`, for kinds of splats in the training set
  std::array<double, kProvenanceCount> provenance{};  // probability of each
  double strangeness = 0;  // ReadingModel::Strangeness; 2 % of splats like the training set exceed 1
  double unit = 0;         // unit of `predictions`, world units
  std::vector<ReadingPrediction> predictions;

  // The assumed provenance: the most likely one. Having full width counts only if those provenances together have 89 %,
  // because the opposite error weighs kFinishedWeight times less.
  Provenance likeliest() const;
  double probability(Provenance of) const { return provenance[static_cast<size_t>(of)]; }
};

// Sizes of training pictures relative to the pictures at hand, as people shrink them, and how often they are not
// shrunk, before a splat is known. 0.5 misses more true widths, 0.9 keeps more wrong ones (`bench reading --score
// --folds`).
inline constexpr std::array kPictureShrinks = {1.0, 0.5, 0.25, 0.125};
inline constexpr double kAsGiven = 0.7;

// The likeliest of `shrinks` for pictures whose pixel is `pixel` (world units). The first is kAsGiven before the splat
// is read, the others are equally likely.
double LikeliestShrink(const Reading& reading, double pixel, std::span<const double> shrinks = kPictureShrinks);

// "a classic splat (98 %)": likeliest() and its probability, never 100 %.
std::string DescribeProvenance(const Reading& reading);

// Reads a splat. kBadArgument: too few Gaussians are visible. Models other than the built-in one serve measurements.
Result<Reading> Read(const CloudView& cloud, const ReadingModel& model = ReadingModel::Shipped());
// `visible`: FindVisibleGaussians(cloud).
Result<Reading> Read(const CloudView& cloud, const VisibleGaussians& visible,
                     const ReadingModel& model = ReadingModel::Shipped());
// Reads a splat from its features.
Reading ReadFrom(const SplatFeatures& features, const ReadingModel& model);

}  // namespace anchorsplat
