#pragma once

#include <cstdint>
#include <vector>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// How densely a splat covers its views, on the mean over some of them.
struct ViewDensity {
  double pixels = 0;     // that show it: alpha of a half and more
  double gaussians = 0;  // whose centre is within the picture
};

// Looks at up to 16 of the cameras. Errors: those of Rasterizer.
Result<ViewDensity> MeasureDensity(const GaussianCloud& cloud, const RenderOptions& render,
                                   const std::vector<Camera>& cameras);

// Into how many each of the `start` Gaussians that a refinement begins with is split, at least 1: so that there are
// `wanted` for each of the `input` ones, but no more than closer views can show. These have upscale² pixels for each of
// `density`, and half of the Gaussians are on the other side of what is seen: two for a pixel are enough. Says so.
int ChooseCopies(const ViewDensity& density, double upscale, int wanted, int64_t input, int64_t start);

}  // namespace anchorsplat
