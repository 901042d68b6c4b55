#pragma once

#include <array>

#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// How bright a photograph came out: target ≈ gain·rendered + bias for each colour channel.
struct ViewExposure {
  std::array<double, 3> gain = {1, 1, 1};
  std::array<double, 3> bias = {0, 0, 0};
};

// Least squares over all pixels, drawn a little towards gain 1 and bias 0 so that a picture without contrast says
// nothing. Gains stay within [½, 2]. Images of one size and three channels (kBadArgument).
Result<ViewExposure> EstimateExposure(const Image& rendered, const Image& target);

// `target` becomes what it would be at gain 1 and bias 0.
void RemoveExposure(const ViewExposure& exposure, Image& target);

// Where the two differ by more than anything that is in the scene at this size can explain, `target` becomes
// `rendered`, so that nothing is learned there: somebody who walked by, a lens flare. The bound is six standard
// deviations of the differences, estimated from their median over pixels that differ at all, and at least `least`.
// Returns how many pixels that were. Images of one size and three channels (kBadArgument).
Result<int64_t> IgnoreOutliers(const Image& rendered, float least, Image& target);

}  // namespace anchorsplat
