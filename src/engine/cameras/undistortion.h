#pragma once

#include <cstdint>

#include "core/buffer.h"
#include "core/camera.h"
#include "core/image.h"
#include "core/lens.h"
#include "core/result.h"

namespace anchorsplat {

// The pinhole that a picture taken through `lens` is undone to, `bent` being its intrinsics. The rule is that of
// COLMAP's image_undistorter as it comes (no blank pixels, sides from 0.2 to 2 times as long), so that splats that were
// trained on its pictures, as 3DGS's convert.py makes them, find the very same cameras: focal lengths stay, and each
// side is cut or lengthened until no pixel at the picture's border is without a place in it. `bent` itself for a
// straight lens. Errors (kBadFile, the end of a sentence, with the coefficients): a lens that cannot be undone over the
// middle of the picture (three quarters of the way to the border, half of it for a fisheye, whose circle may lie
// inside), one that would leave less than a fifth of a side, where COLMAP stops cutting; a size that no picture may
// have.
Result<Pinhole> StraightPinhole(const Lens& lens, const Pinhole& bent);

// A view's picture, and where it says nothing.
struct ViewPicture {
  Image image;              // [C,H,W], 3 channels, or 4 with straight alpha
  Buffer<uint8_t> ignored;  // [H,W] 1 where nothing is asked; empty: nowhere
};

// The picture as the pinhole `straight` would have taken it: each pixel's centre is looked up where the lens draws it,
// between pixels by Catmull-Rom's cubics (colours premultiplied where there is alpha). A pixel whose place lies outside
// of the picture, in a part that the lens's model folds over, or next to an ignored one, is ignored. The same bits for
// any number of threads.
ViewPicture Undistort(const ViewPicture& picture, const Lens& lens, const Pinhole& bent, const Pinhole& straight);

// Means of `factor` × `factor` pixels (colours premultiplied where there is alpha); what is over at the right and at
// the bottom is left out. A pixel is ignored if one of those that it is made of is.
ViewPicture Downscaled(const ViewPicture& picture, int factor);
// The camera of that: rays stay where they were.
Pinhole Downscaled(const Pinhole& intrinsics, int factor);

}  // namespace anchorsplat
