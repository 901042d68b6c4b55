#pragma once

#include <array>
#include <cstdint>

#include "render/adam_runs.h"
#include "render/blend_backward.h"
#include "render/projected_gaussian.h"

namespace anchorsplat {

// From ∂L/∂rgb to the coefficients and, through the direction of view, to the means. Nothing flows through a channel
// that is clamped at 0.
struct SphericalHarmonicsBackwardParams {
  int64_t count;                       // N Gaussians
  int degree;                          // 0–3, evaluated
  int64_t stride;                      // floats of `sh` from one Gaussian to the next, ≥ 3·(degree+1)²
  const float* means;                  // [N,3] world
  const float* sh;                     // [N,stride/3,3] coefficient-major, rgb fastest
  std::array<double, 3> center;        // camera centre, world
  const ProjectedGaussian* projected;  // [N] rgb of SphericalHarmonicsCpu
  const BlendGradient* gradients;      // [N] of SumSlots; read where visible
  const int32_t* visible;              // [N] as ProjectBackwardParams::visible
  const int32_t* visible_counts;       // [ProjectChunks(N)]
  // in and out
  float* mean_gradients;  // [N,3] per world unit; the part through the direction is added
  // out; rows of culled Gaussians and coefficients above the degree become 0
  float* sh_gradients;  // [N,stride/3,3]; null where `step` uses them instead
  // in and out, else null: the coefficients take this step as soon as their gradient is known, `sh` being its values
  const CoefficientStep* step;
};

// Gaussians of one chunk, [chunk·kProjectChunk, …).
void SphericalHarmonicsBackwardCpu(const SphericalHarmonicsBackwardParams& p, int64_t chunk);

// The step alone, with a gradient [N,stride/3,3] that is at hand: the same bits as where it is made.
void StepCoefficients(const CoefficientStep& step, int64_t stride, int64_t count, const float* gradient);

}  // namespace anchorsplat
