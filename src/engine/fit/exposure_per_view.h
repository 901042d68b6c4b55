#pragma once

#include <cstdint>

#include "core/buffer.h"
#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// Exposures of the views of a fit, which begins without knowing what the scene looks like: each view's gain and bias
// are followed over the steps instead of believed at once, and count only as far as they differ from those of the other
// views. Or else a fit that is a little too dark would make its pictures darker, and so itself.
Buffer<float> NoExposures(int64_t views);  // [V,6]: three gains of 1, three biases of 0

inline constexpr float kExposureRate = 0.3f;  // how far a step's measurement moves a view's values

// Takes the exposure of view `view` out of its `picture` after `rendered`, what the fit shows for it now, has moved it:
// EstimateExposure (view_exposure.h), which is drawn towards gain 1 and bias 0; then the geometric mean of all views'
// gains and the mean of their biases are divided and taken off. Errors: as EstimateExposure; kBadArgument: no such
// view.
Status FollowExposure(const Image& rendered, int64_t view, Image& picture, Buffer<float>& exposures);

}  // namespace anchorsplat
