#pragma once

#include <cmath>

#include "core/activations.h"

namespace anchorsplat {

// Conversions of stored lengths and opacities that keep NaN: such Gaussians are not drawn, while other conversions
// would make them flat or faint.
inline float LogFromStoredScale(float scale) { return std::isnan(scale) ? scale : LogFromScale(scale); }
inline float LogitFromStoredOpacity(float opacity) { return std::isnan(opacity) ? opacity : LogitFromOpacity(opacity); }

}  // namespace anchorsplat
