#pragma once

#include <array>
#include <cstdint>

#include "render/adam_runs.h"
#include "render/blend_backward.h"
#include "render/projected_gaussian.h"

namespace anchorsplat {

// Propagates ∂L/∂rgb to the coefficients and, through the viewing direction, to the means. Channels clamped at 0 pass
// no gradient.
struct SphericalHarmonicsBackwardParams {
  int64_t count;                       // N Gaussians
  int degree;                          // 0–3, evaluated
  int64_t stride;                      // floats between Gaussians in `sh`, ≥ 3·(degree+1)²
  const float* means;                  // [N,3] world
  const float* sh;                     // [N,stride/3,3] coefficient-major, rgb fastest
  std::array<double, 3> center;        // camera centre, world
  const ProjectedGaussian* projected;  // [N] rgb from SphericalHarmonicsCpu
  const BlendGradient* gradients;      // [N] from SumSlots; read if visible
  const int32_t* visible;              // [N] as ProjectBackwardParams::visible
  const int32_t* visible_counts;       // [ProjectChunks(N)]
  // in and out
  float* mean_gradients;  // [N,3] per world unit; the part through the direction is added
  // out; 0 for culled Gaussians and coefficients above the degree
  float* sh_gradients;  // [N,stride/3,3]; null if `step` uses them instead
  // in and out, or null: a step for the coefficients, taken as their gradient is computed; `sh` are its values
  const CoefficientStep* step;
};

// Processes one chunk: Gaussians [chunk·kProjectChunk, …).
void SphericalHarmonicsBackwardCpu(const SphericalHarmonicsBackwardParams& p, int64_t chunk);

// Applies the step alone, with a given gradient [N,stride/3,3]; bit-identical to the fused version.
void StepCoefficients(const CoefficientStep& step, int64_t stride, int64_t count, const float* gradient);

}  // namespace anchorsplat
