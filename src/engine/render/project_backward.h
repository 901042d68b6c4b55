#pragma once

#include <cstdint>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "render/blend_backward.h"
#include "render/constants.h"
#include "render/projected_gaussian.h"

namespace anchorsplat {

// From the sums of blending to the stored values of geometry and opacity: through the conic, the Jacobian (clamped
// ratios are constants), the covariance, the quaternion's normalisation, exp and sigmoid, and the compensation of
// modes that have one.
struct ProjectBackwardParams {
  int64_t count;                // N Gaussians
  const float* means;           // [N,3] world
  const float* log_scales;      // [N,3] ln(world units); −Inf is scale 0
  const float* quats;           // [N,4] wxyz, any norm; the zero quaternion is the identity
  const float* opacity_logits;  // [N] logit(opacity)
  Pinhole intrinsics;           // pixels
  Pose world_to_camera;         // OpenCV axes
  RenderMode mode = RenderMode::kClassic;
  float dilation = kDilation;          // px²
  float compensated_from = 0;          // px²
  const ProjectedGaussian* projected;  // [N] of ProjectCpu
  const BlendGradient* gradients;      // [N] of SumSlots; read where visible
  const int32_t* visible;              // [N] rows that are not culled, ascending, each chunk's from c·kProjectChunk on
  const int32_t* visible_counts;       // [ProjectChunks(N)] how many of each chunk
  // out; rows of culled Gaussians become 0
  float* mean_gradients;           // [N,3] per world unit
  float* log_scale_gradients;      // [N,3]
  float* quat_gradients;           // [N,4] of the quaternion as stored
  float* opacity_logit_gradients;  // [N]
  float* means2d;                  // [N,2] ∂L/∂(mean in the picture), per pixel
};

// Gaussians of one chunk, [chunk·kProjectChunk, …).
void ProjectBackwardCpu(const ProjectBackwardParams& p, int64_t chunk);

}  // namespace anchorsplat
