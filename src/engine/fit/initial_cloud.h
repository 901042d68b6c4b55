#pragma once

#include <cstdint>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "fit/initial_points.h"

namespace anchorsplat {

// How points become Gaussians, as gsplat's trainer does it.
struct InitialCloudOptions {
  double opacity = 0.1;
  double scale = 1;   // × the root of the mean squared distance to the three nearest points
  int sh_degree = 3;  // 0–3
  uint64_t seed = 0;  // of the rotations
};

// An isotropic Gaussian per point with the point's colour in degree 0 and quaternions uniform in [0,1]⁴. Coinciding
// points get a scale of 1e-4 scene scales at least, where gsplat takes the logarithm of 0.
//
// Errors (kBadArgument): no points, arrays that disagree, positions that are not finite, options out of range.
Result<GaussianCloud> InitialCloud(const InitialPoints& points, double scene_scale, const InitialCloudOptions& options);

}  // namespace anchorsplat
