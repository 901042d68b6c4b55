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

// Those of the training cameras, and then `between` poses for each of them on the way to its neighbours: the nearest
// cameras that look the same way (within 45°) and have the same intrinsics. Nothing is asked about places that no
// camera was near.
std::vector<Camera> PosesAlong(const std::vector<Camera>& cameras, int between);

}  // namespace anchorsplat
