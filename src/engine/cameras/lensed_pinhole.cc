#include "cameras/lensed_pinhole.h"

#include <cmath>

#include "cameras/camera_checks.h"
#include "cameras/undistortion.h"
#include "core/finite.h"

namespace anchorsplat {

Result<LensedPinhole> ThroughLens(const Lens& lens, const Pinhole& bent) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckIntrinsics(bent));
  if (lens.IsStraight()) return LensedPinhole{bent, {}};
  if (!AllFinite(lens.radial) || !AllFinite(lens.denominator) || !AllFinite(lens.tangential) ||
      !std::isfinite(lens.skew)) {
    return Error{ErrorCode::kBadFile, "lens distortion is not finite"};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Pinhole straight, StraightPinhole(lens, bent));
  return LensedPinhole{straight, {.lens = lens, .intrinsics = bent, .mask = {}}};
}

}  // namespace anchorsplat
