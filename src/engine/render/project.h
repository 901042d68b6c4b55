#pragma once

#include <cstdint>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "render/constants.h"
#include "render/profile.h"
#include "render/projected_gaussian.h"

namespace anchorsplat {

// EWA projection of 3-D Gaussians to the image (Zwicker et al. 2002; Kerbl et al. 2023), culling, and the tiles each
// one may touch: the profile's square cut down to the box of the ellipse where α reaches `min_alpha`, outside of which
// blending would skip every pixel anyway.
//
// Inside, where a Gaussian is seen is calculated in double and its shape in float; the determinant of a needle's
// covariance, and therefore its conic, is a sum of squares that loses nothing. The few shapes that leave the range of
// floats (IsExtreme in render/projection-inl.h) are calculated in double, too.
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
  float compensated_from = 0;   // px², the dilation whose integral a mode that compensates keeps
  float min_alpha = kMinAlpha;  // > 0; Gaussians whose opacity is lower are culled
  // out
  ProjectedGaussian* projected;  // [N] all but rgb; rows of culled Gaussians are not written
  TileRect* tiles;               // [N] empty = culled
  int32_t* radii;                // [N,2] pixels as the profile defines them, 0 = outside by its rules; may be null
  int32_t* visible;              // [N] rows that are not culled, ascending, each chunk's from c·kProjectChunk on
  int32_t* visible_counts;       // [ProjectChunks(N)] how many of each chunk
  int64_t* slot_counts;          // [ProjectChunks(N)] tiles of each chunk's Gaussians, all together; may be null
};

inline int64_t ProjectChunks(int64_t count) { return (count + kProjectChunk - 1) / kProjectChunk; }
inline int TilesAcross(int pixels) { return (pixels + kTile - 1) / kTile; }

// Gaussians that are not usable (IsUsable in core/gaussian_cloud.h, as far as these arrays go), behind the near plane,
// beyond the far plane, off the image, or with a covariance that is not positive definite are culled.
void ProjectCpu(const ProjectParams& p);

}  // namespace anchorsplat
