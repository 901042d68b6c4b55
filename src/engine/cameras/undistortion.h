#pragma once

#include <cstdint>

#include "core/buffer.h"
#include "core/camera.h"
#include "core/image.h"
#include "core/lens.h"
#include "core/result.h"

namespace anchorsplat {

// Intrinsics of the undistorted image for a lens and its `distorted` intrinsics. Follows the defaults of COLMAP's
// image_undistorter (no blank pixels, sides scaled by 0.2 to 2), so that splats trained on its output, as by 3DGS's
// convert.py, match exactly: focal lengths stay, and each side is cropped or extended until every border pixel has a
// source. Returns `distorted` if the lens distorts nothing.
//
// Errors (kBadFile, the end of a sentence, with the coefficients): a lens that is not invertible over the image centre
// (out to three quarters of the way to the border; half for a fisheye, whose circle may be smaller); a result below a
// fifth of a side, where COLMAP stops cropping; an image size beyond the limits.
Result<Pinhole> UndistortedPinhole(const Lens& lens, const Pinhole& distorted);

// The picture of a view, and which pixels to ignore.
struct ViewPicture {
  Image image;              // [C,H,W], 3 channels, or 4 with straight alpha
  Buffer<uint8_t> ignored;  // [H,W] 1: ignored; empty: none
};

// Resamples `picture` to the undistorted view by Catmull-Rom interpolation (with premultiplied alpha). A pixel is
// ignored if its source is outside of the picture, beyond the fold of the lens model, or next to an ignored pixel.
// Bit-identical for any number of threads.
ViewPicture Undistort(const ViewPicture& picture, const Lens& lens, const Pinhole& distorted,
                      const Pinhole& undistorted);

// Averages blocks of `factor` × `factor` pixels (with premultiplied alpha); incomplete blocks at the right and bottom
// are dropped. A result is ignored if any of its pixels is.
ViewPicture Downscaled(const ViewPicture& picture, int factor);
// Intrinsics of the downscaled picture; rays stay the same.
Pinhole Downscaled(const Pinhole& intrinsics, int factor);

}  // namespace anchorsplat
