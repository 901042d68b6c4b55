#pragma once

#include <cstdint>
#include <vector>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// Poses at which to render a splat when there are no pictures of it.

// `count` evenly spread poses all around an object, rotated together by `seed`. Distance: the central 98 % of visible
// Gaussians fill a view of 45°. Picture size: a pixel at the object's centre covers `pixel_size` (world units). Poses
// inside or close to something opaque are left out.
//
// Errors (kBadArgument): count below 1; a pixel size not positive, or so small that a picture exceeds kMaxImageSide;
// more than half of the poses are inside something, so this is a scene seen from within, whose cameras must be known.
Result<std::vector<Camera>> PosesAround(const GaussianCloud& cloud, double pixel_size, int64_t count, uint64_t seed);

// The training cameras, then interpolated poses between each and its `between` neighbours: the nearest cameras that
// look the same way (within 45°) with the same intrinsics. One pose per pair. Regions without nearby cameras get no
// poses.
std::vector<Camera> PosesAlong(const std::vector<Camera>& cameras, int between);

// Dissimilarity of two views: distance of their centres in units of `scale` (world units), plus the angle between them
// in radians.
double PoseDistance(const Camera& a, const Camera& b, double scale);

// Poses to optimise at, and others to check the result.
struct RefinePoses {
  std::vector<Camera> train, check;
  bool apart = true;  // `check` poses are away from all `train` ones; false: they are some of them, for lack of others
};

// Train: PosesAlong. Check: up to `checks` others; of the poses between cameras the half farthest from all cameras.
// Train poses closer to a check pose than half the distance of the cameras are dropped. If there is nothing between
// cameras, some of them are held out, if there are at least six.
RefinePoses RefinePosesAlong(const std::vector<Camera>& cameras, int between, int64_t checks);

// PosesAround with `checks` evenly chosen ones held out and `count` left, except those inside something. Errors: those
// of PosesAround.
Result<RefinePoses> RefinePosesAround(const GaussianCloud& cloud, double pixel_size, int64_t count, int64_t checks,
                                      uint64_t seed);

// At most `most` cameras, evenly chosen.
std::vector<Camera> SubsampleEvenly(const std::vector<Camera>& cameras, int64_t most);

}  // namespace anchorsplat
