#pragma once

#include <array>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/image.h"
#include "core/result.h"
#include "fit/view_exposure.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// Corrects poses of photographs, which are off by up to a pixel or two. A splat fitted to all of them shows their mean,
// which is blurred.
//
// Gauss–Newton on the picture (Lucas and Kanade 1981, as in Baker and Matthews 2004, section 2, with the flow of a
// rigid motion). The camera's small rotation ω and translation t, in its own axes, move a point at depth z by
//     Δx = fx·(t_x − x·t_z)/z + fx·(ω_y − y·ω_z) − fx·x·(x·ω_y − y·ω_x), Δy likewise    (x, y: the ray, at z = 1).
// The difference between render and picture determines them, where the render is solid and its colours have a gradient.
// Units: each of the six moves the picture's centre by a pixel. Motions that the picture cannot distinguish, such as
// translation and rotation for a flat object, stay as small as possible.
inline constexpr double kMostAligned = 4;  // pixels: maximum of each of the six, from the original pose

class PoseAligner {
 public:
  // Moves `camera` towards where `picture` ([3,H,W], of the camera's size) of `cloud` was taken, in `steps` steps with
  // one render each. `origin`: the camera as in its file. If nothing solid is in view the camera stays. Deterministic.
  // Errors: those of Rasterizer; kBadArgument: a picture of another size.
  //
  // `exposure`: the picture may differ in brightness and tint (view_exposure.h).
  Result<Camera> Align(const GaussianCloud& cloud, const RenderOptions& render, const Camera& origin,
                       const Camera& camera, const Image& picture, bool exposure, int steps);

 private:
  Rasterizer rasterizer_;
  RenderOutput output_;
  Image compared_;
};

// The camera after a small motion in its own axes: rotation[3] (radians, about x, y, z), then translation[3] (world
// units) of what it sees.
Camera Moved(const Camera& camera, const std::array<double, 6>& motion);

// Inverse of Moved: the six numbers that take `origin` to `camera`.
std::array<double, 6> MotionBetween(const Camera& origin, const Camera& camera);

}  // namespace anchorsplat
