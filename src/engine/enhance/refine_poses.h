#pragma once

#include <cstdint>
#include <vector>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// Where a splat can be asked what it looks like, when there are no pictures of it.

// `count` poses all around an object, evenly spread and turned as a whole by `seed`: at the distance from which the
// middle 98 % of its visible Gaussians fill a view of 45°, in pictures of as many pixels as make one of them
// `pixel_size` (world units) large at its middle. Poses inside of something opaque or close to it are left out.
//
// Errors (kBadArgument): count below 1; a pixel size that is not positive, or so small that a picture would have more
// than kMaxImageSide pixels per side; more than half of the poses are inside of something, which means that this is
// no object but a scene seen from within, whose cameras must be known.
Result<std::vector<Camera>> PosesAround(const GaussianCloud& cloud, double pixel_size, int64_t count, uint64_t seed);

// Those of the training cameras, and then places on the way from each of them to its `between` neighbours: the nearest
// cameras that look the same way (within 45°) and have the same intrinsics. One place for two cameras, whichever of
// them is asked first. Nothing is asked about places that no camera was near.
std::vector<Camera> PosesAlong(const std::vector<Camera>& cameras, int between);

// How far two cameras are from seeing the same: the distance of their centres, `scale` (world units) being 1, plus the
// angle between them in radians.
double PoseDistance(const Camera& a, const Camera& b, double scale);

// Places to learn at, and others to see whether it helped.
struct RefinePoses {
  std::vector<Camera> train, check;
  bool apart = true;  // no place of `check` is near one of `train`; false: there is nowhere else, they are some of them
};

// PosesAlong, and up to `checks` other places: of those between cameras and their neighbours the half that is farthest
// from all cameras. None of `train` is nearer to one of `check` than half as far as the cameras are. Where nothing is
// between cameras, some of them are set apart, if there are six and more.
RefinePoses RefinePosesAlong(const std::vector<Camera>& cameras, int between, int64_t checks);

// PosesAround, of which `checks` evenly chosen ones are set apart; `count` are left, but for those inside of something.
// Errors: those of PosesAround.
Result<RefinePoses> RefinePosesAround(const GaussianCloud& cloud, double pixel_size, int64_t count, int64_t checks,
                                      uint64_t seed);

// `most` of the cameras, or all, evenly chosen.
std::vector<Camera> Thinned(const std::vector<Camera>& cameras, int64_t most);

}  // namespace anchorsplat
