#pragma once

#include "cameras/undistortion.h"
#include "core/camera.h"
#include "core/result.h"

namespace anchorsplat {

// Adapts a camera to its image file, at 1/`downscale` of the resolution:
//
// * An image of another size but the same aspect ratio is a rescaled one.
// * An image that fits only after its EXIF rotation will be rotated. One that fits as stored is taken as stored,
// whatever
//   its EXIF says: camera files mostly refer to stored pixels, and if width and height cannot tell (a half turn, a
//   mirror, a square) there is no better evidence.
//
// Sets `intrinsics` to those of ReadPhotograph's result. Call it once per camera. Errors: those of ReadImageSize and
// UndistortedPinhole; kBadFile: another aspect ratio, an image smaller than `downscale`.
Status MatchPhotograph(Camera& camera, int downscale = 1);

inline constexpr int kMaxDownscale = 64;

// The picture of a view: decoded, rotated, masked, undistorted, downscaled to the size of `intrinsics`. Errors: those
// of ReadImage; kBadFile: the image does not have its camera's size, or the mask neither the image's size nor its
// aspect ratio.
Result<ViewPicture> ReadPhotograph(const Camera& camera);

}  // namespace anchorsplat
