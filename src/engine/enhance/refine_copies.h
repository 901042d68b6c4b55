#pragma once

#include <cstdint>
#include <vector>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// Density of Gaussians in the views, averaged over some of them.
struct ViewDensity {
  double pixels = 0;     // pixels covered, with alpha of at least a half
  double gaussians = 0;  // Gaussians with their centre in the picture
};

// Measures up to 16 of the views. Errors: those of Rasterizer.
Result<ViewDensity> MeasureDensity(const GaussianCloud& cloud, const RenderOptions& render,
                                   const std::vector<Camera>& cameras);

// Number of copies, at least 1, into which to split each of the `start` Gaussians. Aims at `wanted` per `input`
// Gaussian, but at no more than closer views can show: 2 per pixel, since half the Gaussians are on the far side and
// closer views have upscale² pixels for each in `density`. Logs the choice.
int ChooseCopies(const ViewDensity& density, double upscale, int wanted, int64_t input, int64_t start);

}  // namespace anchorsplat
