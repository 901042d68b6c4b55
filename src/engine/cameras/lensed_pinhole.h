#pragma once

#include "core/camera.h"
#include "core/result.h"

namespace anchorsplat {

// Intrinsics shared by views: of the undistorted view, and of the images as stored.
struct LensedPinhole {
  Pinhole undistorted;
  Photograph photograph;
};

// Intrinsics for images taken through `lens` with intrinsics `distorted`; the lens is dropped if it distorts nothing.
// Errors (kBadFile, the end of a sentence): those of CheckIntrinsics and UndistortedPinhole; a coefficient that is not
// finite.
Result<LensedPinhole> ThroughLens(const Lens& lens, const Pinhole& distorted);

}  // namespace anchorsplat
