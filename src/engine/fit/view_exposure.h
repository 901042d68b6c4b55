#pragma once

#include <array>

#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// Exposure of a photograph: target ≈ gain·rendered + bias per colour channel.
struct ViewExposure {
  std::array<double, 3> gain = {1, 1, 1};
  std::array<double, 3> bias = {0, 0, 0};
};

// Least-squares estimate over all pixels, slightly regularised towards gain 1 and bias 0 so that a picture without
// contrast has no effect. Gains stay within [½, 2]. Errors (kBadArgument): images not of one size and three channels.
Result<ViewExposure> EstimateExposure(const Image& rendered, const Image& target);

// Converts `target` to gain 1 and bias 0.
void RemoveExposure(const ViewExposure& exposure, Image& target);

// Replaces outliers in `target` by `rendered`, so that nothing is learned there: passers-by, lens flares. An outlier
// differs by more than six standard deviations, estimated from the median difference over pixels that differ at all,
// and by at least `least`. Returns their number. Errors (kBadArgument): images not of one size and three channels.
Result<int64_t> IgnoreOutliers(const Image& rendered, float least, Image& target);

}  // namespace anchorsplat
