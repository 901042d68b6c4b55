#pragma once

#include "core/camera.h"
#include "core/result.h"

namespace anchorsplat {

// Intrinsics that views share: the pinhole that their pictures are undone to, and how the pictures come.
struct LensedPinhole {
  Pinhole straight;
  Photograph photograph;
};

// Of pictures taken through `lens`, `bent` being their intrinsics; without a lens where it is straight. Errors
// (kBadFile, the end of a sentence): those of CheckIntrinsics and StraightPinhole; a coefficient that is not finite.
Result<LensedPinhole> ThroughLens(const Lens& lens, const Pinhole& bent);

}  // namespace anchorsplat
