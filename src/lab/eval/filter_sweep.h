#pragma once

#include <span>
#include <vector>

#include "core/result.h"
#include "enhance/pixel_size.h"
#include "eval/method.h"

namespace anchorsplat {

// Strengths tried in a search.
std::span<const double> FilterStrengths();

// Training pixel size of each Gaussian of object.low, world units: the median over the views that contain it, as
// objects are seen from all around (enhance/pixel_size.h).
Result<CameraPixelSizes> TruePixelSizes(const BenchmarkObject& object);

// The strength with the best mean PSNR over at most twenty of the task's views, interpolated by the parabola through
// the best tried one and its neighbours.
Result<double> BestFilterStrength(const MethodTask& task);

// Position of the maximum of the parabola through the largest value and its neighbours; at an end, the end itself. `x`
// ascending, as long as `y`, not empty.
double TopOfParabola(std::span<const double> x, std::span<const double> y);

}  // namespace anchorsplat
