#pragma once

#include <span>
#include <vector>

#include "core/result.h"
#include "enhance/pixel_size.h"
#include "eval/method.h"

namespace anchorsplat {

// The strengths that are tried where one is looked for.
std::span<const double> FilterStrengths();

// World size of the training pixels of each Gaussian of object.low: the median over the views that hold it, since these
// objects are seen from all around (enhance/pixel_size.h).
Result<CameraPixelSizes> TruePixelSizes(const BenchmarkObject& object);

// The strength with the best mean PSNR over the task's views (at most twenty of them), between the tried ones by the
// parabola through the best and its neighbours.
Result<double> BestFilterStrength(const MethodTask& task);

// Where the parabola through the largest value and its two neighbours has its top; the largest itself at an end.
// `x` ascending, as many as `y`, at least one.
double TopOfParabola(std::span<const double> x, std::span<const double> y);

}  // namespace anchorsplat
