#pragma once

#include <array>
#include <cstdint>

#include "render/projected_gaussian.h"

namespace anchorsplat {

// View-dependent colour of the visible Gaussians: max(Σ c_k Y_k(d) + 0.5, 0), with d the unit vector from the camera
// centre to the mean (basis: core/spherical_harmonics.h). Gaussians with a non-finite coefficient are culled here:
// their tiles are emptied and they leave the list.
struct SphericalHarmonicsParams {
  int64_t count;                 // N Gaussians
  int degree;                    // 0–3, evaluated
  int64_t stride;                // floats between Gaussians in `sh`, ≥ 3·(degree+1)²
  const float* means;            // [N,3] world
  const float* sh;               // [N,stride/3,3] coefficient-major, rgb fastest
  std::array<double, 3> center;  // camera centre, world
  // in and out
  int32_t* visible;         // [N] as ProjectParams::visible
  int32_t* visible_counts;  // [ProjectChunks(N)]
  TileRect* tiles;          // [N]
  // out
  ProjectedGaussian* projected;  // [N] rgb of the visible rows
};

void SphericalHarmonicsCpu(const SphericalHarmonicsParams& p);

}  // namespace anchorsplat
