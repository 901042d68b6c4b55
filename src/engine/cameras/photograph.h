#pragma once

#include "cameras/undistortion.h"
#include "core/camera.h"
#include "core/result.h"

namespace anchorsplat {

// Fits a camera whose file is known to the picture in it, and asks for a `downscale`-th of its pixels per side:
//
// * A picture of another size than the camera file says is a scaled one when its shape agrees.
// * One that agrees only when it is turned as its EXIF orientation says will be turned. One that agrees as it is stored
//   is taken so, whatever its EXIF says: camera files mostly count stored pixels, and where width and height say
//   nothing (a half turn, a mirror, a square) there is nothing better to go by.
//
// Sets `intrinsics` to those of the picture that ReadPhotograph gives. Call it once. Errors: those of ReadImageSize;
// kBadFile: another shape, a picture that is smaller than `downscale`; as StraightPinhole.
Status MatchPhotograph(Camera& camera, int downscale = 1);

inline constexpr int kMostDownscale = 64;

// The view's picture: decoded, turned, masked, without the lens, averaged down. Its size is that of `intrinsics`.
// Errors: those of ReadImage; kBadFile: the picture has not its camera's size, or the mask neither the picture's size
// nor its shape.
Result<ViewPicture> ReadPhotograph(const Camera& camera);

}  // namespace anchorsplat
