#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat {

struct SizeTails;  // enhance/trained_kind.h

// Whether a network has enhanced a splat that does not say so. Networks make several Gaussians of each: most have a
// near twin, of nearly the same covariance, colour and opacity, where fits make each of its own. Sizes and opacities of
// what a network makes are also unlike those of a fit.

// Of ShowingGaussians::all and its SizeTailsOf, at up to 4000 of them, evenly spread over the rows. Difference of two
// Gaussians: the norm of the difference of their covariances' logarithms, halved (log-scales as matrices). Twin: the
// one of the eight nearest that differs least.
//
//   0–14   ln(x + 0.02), x the quantiles 0.1, 0.25, 0.5, 0.75, 0.9 of the difference from the twin, then from the
//   second
//          and the third of the eight
//   15–23  ln(x + 0.02), x the quartiles of the distance to the twin in standard deviations, of the difference of the
//          constant colours (SH coefficients; of the channel that differs most) and of the opacity logits
//   24–30  sizes: ln(tail + 0.02) of the smallest and of the middle axis and ln(roundness) of enhance/trained_kind.h;
//          medians of ln(smallest / middle) and ln(largest / middle) of the axes' quantiles; ln of the smallest axis's
//          median over its quantiles 0.1 and 0.25
//   31–34  opacities: SizeTails::opaque, the share above 0.95, median, first quartile
//
// No feature depends on the unit. Nothing: fewer than 1000 Gaussians.
inline constexpr size_t kEnhancedLookFeatures = 35;
// What bounds which splats can look enhanced at all.
inline constexpr size_t kTwinUpperQuartile = 3, kFlatness = 27, kElongation = 28;
using EnhancedLook = std::array<double, kEnhancedLookFeatures>;

// Whether trained quaternions are still there: trainers use their direction alone and leave them at any length (half of
// them and more are off by over a hundredth). Networks write unit quaternions, ours and the published one, and so do
// the formats besides PLY; what is refined after a network stays near, with pictures a quarter to two fifths of it are
// off by over a hundredth. What has lengths of its own no network has made.
bool HasQuaternionsOfTraining(const GaussianCloud& showing);

struct FoundTwins {
  // Whether twins are turned as if they had nothing to do with each other, and lie on top of each other or far apart.
  // No network makes that: it turns those of one Gaussian little, and where it makes one of each, twins are as far
  // apart as in fits of many steps. In fits of few, clones of densification lie on top of each other, and all sizes are
  // still alike.
  bool unrelated = false;
  std::vector<std::array<int64_t, 2>> rows;  // of the sample: a Gaussian and its twin
};
std::optional<EnhancedLook> FindEnhancedLook(const GaussianCloud& showing, const SizeTails& tails,
                                             FoundTwins* twins = nullptr);

// How alike the harmonics of twins are: upper quartile of the cosine between those of degree 2 and 3. A network
// multiplies those of a Gaussian for all of its copies: 0.98 and more; fits give each their own: 0.95 and less, as
// where a network has made one of each. `rows_of_showing`: which rows of `whole` the rows of `twins` are. Nothing: the
// cloud has none, or in the steps of a format, or too few twins have any.
std::optional<double> LikenessOfHarmonics(const CloudView& whole, std::span<const int64_t> rows_of_showing,
                                          const FoundTwins& twins);
inline constexpr double kOwnHarmonics = 0.965;  // below it each has its own

// ln of the odds that a network has enhanced it: a network of one small layer that has learned from fits as they are
// and enhanced (scripts/train-enhanced-look.py). −∞ where fewer than three in four Gaussians have a twin that differs
// by less than a factor of e, and where they are balls, as some trainers make them, which are all alike: no network
// makes that.
double LogOddsOfEnhanced(const EnhancedLook& look);

}  // namespace anchorsplat
