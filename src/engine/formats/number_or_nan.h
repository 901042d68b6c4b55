#pragma once

#include <cmath>

#include "core/activations.h"

namespace anchorsplat {

// Of lengths and opacities as files have them. NaN stays what it is, which nobody draws: it is neither flat nor faint.
inline float LogFromStoredScale(float scale) { return std::isnan(scale) ? scale : LogFromScale(scale); }
inline float LogitFromStoredOpacity(float opacity) { return std::isnan(opacity) ? opacity : LogitFromOpacity(opacity); }

}  // namespace anchorsplat
