#pragma once

#include <cstdint>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "render/constants.h"
#include "render/profile.h"
#include "render/projected_gaussian.h"

namespace anchorsplat {

// EWA projection of 3-D Gaussians to the image (Zwicker et al. 2002; Kerbl et al. 2023), culling, and the tiles each
// may touch: the profile's square, reduced to the box of the ellipse where α reaches `min_alpha`, outside of which
// blending would skip all pixels.
//
// Positions are computed in double and shapes in float. The determinant of a needle's covariance, and thus its conic,
// is a sum of squares without cancellation. The few shapes beyond the range of floats (IsExtreme in
// render/projection-inl.h) are also computed in double.
struct ProjectParams {
  int64_t count;                // N Gaussians
  const float* means;           // [N,3] world
  const float* log_scales;      // [N,3] ln(world units); −Inf is scale 0
  const float* quats;           // [N,4] wxyz, any norm; the zero quaternion is the identity
  const float* opacity_logits;  // [N] logit(opacity); ±Inf is opacity 1 or 0
  Pinhole intrinsics;           // pixels
  Pose world_to_camera;         // OpenCV axes
  RasterProfile profile = RasterProfile::kGsplat14;
  RenderMode mode = RenderMode::kClassic;
  float near_plane = kNear;     // world units along z; nearer Gaussians are culled
  float far_plane = kFar;       // world units along z; farther Gaussians are culled
  float dilation = kDilation;   // px², added to both variances of the 2-D covariance
  float compensated_from = 0;   // px², the dilation whose integral a compensating mode preserves
  float min_alpha = kMinAlpha;  // > 0; Gaussians of lower opacity are culled
  // out
  ProjectedGaussian* projected;  // [N] all except rgb; not written for culled Gaussians
  TileRect* tiles;               // [N] empty = culled
  int32_t* radii;                // [N,2] pixels as the profile defines them, 0 = outside by its rules; may be null
  int32_t* visible;              // [N] visible rows, ascending; those of chunk c start at c·kProjectChunk
  int32_t* visible_counts;       // [ProjectChunks(N)] visible rows per chunk
  int64_t* slot_counts;          // [ProjectChunks(N)] total tiles of each chunk's Gaussians; may be null
};

inline int64_t ProjectChunks(int64_t count) { return (count + kProjectChunk - 1) / kProjectChunk; }
inline int TilesAcross(int pixels) { return (pixels + kTile - 1) / kTile; }

// Culls Gaussians that are unusable (IsUsable in core/gaussian_cloud.h, for these arrays), nearer than the near plane,
// beyond the far plane, off the image, or without a positive definite covariance.
void ProjectCpu(const ProjectParams& p);

}  // namespace anchorsplat
