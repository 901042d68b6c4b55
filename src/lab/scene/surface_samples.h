#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/camera.h"
#include "scene/ray_tracer.h"

namespace anchorsplat {

// A point of the surface as a view would find it: what structure from motion gives for photographs, without its errors.
struct SurfaceSample {
  std::array<float, 3> position;
  std::array<float, 3> color;  // 0–1, lit, as the cameras see it
};

// Up to `count` points spread evenly over the area that at least one of `cameras` sees (32 of them are asked, evenly
// chosen). Fewer come back when hardly anything of the mesh is visible. Deterministic for a seed. No cameras, no
// points.
std::vector<SurfaceSample> SampleSurface(const RayTracer& tracer, const CameraSet& cameras, int64_t count,
                                         uint64_t seed);

}  // namespace anchorsplat
