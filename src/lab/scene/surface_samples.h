#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/camera.h"
#include "scene/ray_tracer.h"

namespace anchorsplat {

// A visible surface point, as structure from motion would reconstruct it, without errors.
struct SurfaceSample {
  std::array<float, 3> position;
  std::array<float, 3> color;  // 0–1, lit, as cameras see it
};

// Samples up to `count` points evenly by area from the surface visible to at least one camera (tests 32 evenly chosen
// ones). Returns fewer if hardly anything is visible, none without cameras. Deterministic for a seed.
std::vector<SurfaceSample> SampleSurface(const RayTracer& tracer, const CameraSet& cameras, int64_t count,
                                         uint64_t seed);

}  // namespace anchorsplat
