#pragma once

#include <cstdint>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// The splat of `bench gpu`, the same on every machine: a bumpy ball of about one unit around the origin, whose surface
// `count` Gaussians of degree 3 cover about five times, whatever their number.
GaussianCloud GpuBenchCloud(int64_t count, uint64_t seed);

// A camera that sees all of it from the side and slightly above; 45° along the shorter side. Cannot fail.
Result<Camera> GpuBenchCamera(int width, int height);

// ∂L/∂pixel for every pixel, uniform in −1 … 1.
RenderGradient GpuBenchWeights(int width, int height, uint64_t seed);

}  // namespace anchorsplat
