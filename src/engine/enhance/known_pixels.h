#pragma once

#include <optional>

#include "core/buffer.h"
#include "core/result.h"
#include "enhance/enhance.h"
#include "reading/reading.h"

namespace anchorsplat {

// Training pixel sizes that need not be read off the splat: given by the caller, or of cameras.
struct KnownPixels {
  Buffer<float> sizes;          // world units, one or [N]; empty: to be read off the splat
  std::optional<double> pixel;  // their median
};

// Errors (kBadArgument): a pixel size that is not positive, or one given along with cameras; a train width without
// cameras, or above theirs.
Status CheckPixelOptions(const EnhanceOptions& options);

// Finds the pixel sizes that `options` give, and logs what the user can do better. Cameras of pictures that were shrunk
// for training are reduced to the size of the training: options.train_width if it is given; else the size at which the
// pictures, if there are any, match the splat best; else the likeliest by `reading`. Fills input.cameras and
// input.times_larger, and the source, camera rule and training width of `report`.
//
// `with_pictures`: options.refine.images are refined against, and give the cameras if there are no others. `believed`:
// the cameras' size is right. `reading`: null if there is none.
// `options` passed CheckPixelOptions. Errors: kBadArgument: cameras that see none of the Gaussians; those of
// OpenProject.
Result<KnownPixels> FindKnownPixels(const EnhanceOptions& options, bool with_pictures, bool believed,
                                    const Reading* reading, EnhanceInput& input, EnhanceReport& report);

}  // namespace anchorsplat
