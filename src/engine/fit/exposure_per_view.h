#pragma once

#include <cstdint>

#include "core/buffer.h"
#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// Exposures of the views of a fit. The scene's look is not known at first, so each view's gain and bias are averaged
// over steps, and only their differences between views count. Otherwise a fit that is slightly too dark would darken
// its pictures and so itself.
Buffer<float> NoExposures(int64_t views);  // [V,6]: three gains of 1, three biases of 0

inline constexpr float kExposureRate = 0.3f;  // weight of a step's measurement in a view's running values

// Updates the exposure of view `view` from `rendered`, its current render, by EstimateExposure (view_exposure.h), and
// removes it from `picture`, relative to the geometric mean gain and the mean bias of all views. Errors: those of
// EstimateExposure; kBadArgument: no such view.
Status FollowExposure(const Image& rendered, int64_t view, Image& picture, Buffer<float>& exposures);

}  // namespace anchorsplat
