#pragma once

#include <cstdint>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "render/blend_backward.h"
#include "render/constants.h"
#include "render/projected_gaussian.h"

namespace anchorsplat {

// Propagates blending's sums to the stored geometry and opacity: through the conic, the Jacobian (clamped ratios are
// constant), covariance, quaternion normalisation, exp and sigmoid, and the compensation of modes that have one.
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
  const ProjectedGaussian* projected;  // [N] from ProjectCpu
  const BlendGradient* gradients;      // [N] from SumSlots; read if visible
  const int32_t* visible;              // [N] visible rows, as ProjectParams::visible
  const int32_t* visible_counts;       // [ProjectChunks(N)] visible rows per chunk
  // out; 0 for culled Gaussians
  float* mean_gradients;           // [N,3] per world unit
  float* log_scale_gradients;      // [N,3]
  float* quat_gradients;           // [N,4] of the quaternion as stored
  float* opacity_logit_gradients;  // [N]
  float* means2d;                  // [N,2] ∂L/∂(2-D mean), per pixel
};

// Processes one chunk: Gaussians [chunk·kProjectChunk, …).
void ProjectBackwardCpu(const ProjectBackwardParams& p, int64_t chunk);

}  // namespace anchorsplat
