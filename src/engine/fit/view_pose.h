#pragma once

#include <array>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/image.h"
#include "core/result.h"
#include "fit/view_exposure.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// Where a photograph was really taken from, near the place that its camera says: poses of photographs are off by a
// fraction of a pixel or two, and a splat that is fitted to all of them shows their mean, which is blurred.
//
// Gauss–Newton on the picture (Lucas and Kanade 1981, in the form of Baker and Matthews 2004, section 2, with the flow
// of a rigid motion): the camera's small rotation ω and shift t, in its own axes, move what is seen at depth z by
//     Δx = fx·(t_x − x·t_z)/z + fx·(ω_y − y·ω_z) − fx·x·(x·ω_y − y·ω_x), Δy likewise    (x, y: the ray, at z = 1)
// and the difference between render and picture, where the render has something solid and its colours a gradient, says
// by how much. All six are in units that move the middle of the picture by a pixel; what the picture does not tell
// apart, such as a shift and a rotation for a flat object, stays as small as it can.
inline constexpr double kMostAligned = 4;  // pixels: no pose goes farther from where it was, in any of the six

class PoseAligner {
 public:
  // `camera`, moved nearer to where `picture` [3,H,W], of the camera's size, was taken of `cloud`: `steps` steps, each
  // from a render of its own. `origin` is the camera as its file has it. Where nothing solid is in the picture the
  // camera stays. Deterministic. Errors: those of Rasterizer; kBadArgument: a picture of another size.
  //
  // With `exposure` the picture may differ in brightness and tint (view_exposure.h).
  Result<Camera> Align(const GaussianCloud& cloud, const RenderOptions& render, const Camera& origin,
                       const Camera& camera, const Image& picture, bool exposure, int steps);

 private:
  Rasterizer rasterizer_;
  RenderOutput output_;
  Image compared_;
};

// The camera after a small motion in its own axes: rotation[3] (radians, about x, y, z) and then shift[3] (world units)
// of what it sees.
Camera Moved(const Camera& camera, const std::array<double, 6>& motion);

// How far a camera has moved from where it was: the six numbers of Moved that lead from `origin` to `camera`.
std::array<double, 6> MotionBetween(const Camera& origin, const Camera& camera);

}  // namespace anchorsplat
