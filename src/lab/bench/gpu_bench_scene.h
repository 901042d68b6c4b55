#pragma once

#include <cstdint>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// The load of `bench gpu`, the same on every machine: a bumpy ball of about one unit around the origin, whose surface
// `count` Gaussians of degree 3 cover about five times over, however many they are.
GaussianCloud GpuBenchCloud(int64_t count, uint64_t seed);

// All of it, from the side and a little above; 45° along the shorter side. Errors: of LookAt, which there are none of.
Result<Camera> GpuBenchCamera(int width, int height);

// ∂L/∂ of every pixel, between -1 and 1.
RenderGradient GpuBenchWeights(int width, int height, uint64_t seed);

}  // namespace anchorsplat
