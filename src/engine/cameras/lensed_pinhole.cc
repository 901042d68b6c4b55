#include "cameras/lensed_pinhole.h"

#include <cmath>

#include "cameras/camera_checks.h"
#include "cameras/undistortion.h"
#include "core/finite.h"

namespace anchorsplat {

Result<LensedPinhole> ThroughLens(const Lens& lens, const Pinhole& distorted) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckIntrinsics(distorted));
  if (lens.IsIdentity()) return LensedPinhole{distorted, {}};
  if (!AllFinite(lens.radial) || !AllFinite(lens.denominator) || !AllFinite(lens.tangential) ||
      !std::isfinite(lens.skew)) {
    return Error{ErrorCode::kBadFile, "lens distortion is not finite"};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Pinhole undistorted, UndistortedPinhole(lens, distorted));
  return LensedPinhole{undistorted, {.lens = lens, .intrinsics = distorted, .mask = {}}};
}

}  // namespace anchorsplat
