#pragma once

#include <cstdint>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "fit/initial_points.h"

namespace anchorsplat {

// How points become Gaussians, as in gsplat's trainer.
struct InitialCloudOptions {
  double opacity = 0.1;
  double scale = 1;   // × the RMS distance to the three nearest points
  int sh_degree = 3;  // 0–3
  uint64_t seed = 0;  // for the rotations
};

// Makes an isotropic Gaussian per point with the point's colour as SH DC and quaternions uniform in [0,1]⁴. Coinciding
// points get a scale of at least 1e-4 scene scales, where gsplat takes the logarithm of 0.
//
// Errors (kBadArgument): no points; arrays of different lengths; non-finite positions; options out of range.
Result<GaussianCloud> InitialCloud(const InitialPoints& points, double scene_scale, const InitialCloudOptions& options);

}  // namespace anchorsplat
