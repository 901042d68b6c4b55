#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/image.h"
#include "core/random.h"
#include "train/seen_gaussians.h"

namespace anchorsplat {

// A window of at most `side` pixels a side inside of a picture, around a random pixel of the object's box.
PixelBox RandomWindow(int width, int height, const PixelBox& object, int side, Random& random);

// What a step looks at when it is about a part of an object: the same spot from several sides.
struct ObjectPart {
  std::vector<size_t> views;      // of the object's
  std::vector<PixelBox> windows;  // of each view, around the spot
  std::vector<int64_t> wanted;  // Gaussians seen in a window, ascending; the nearest to the spot if there are too many
  std::vector<int64_t> others;  // those that may show in a window besides, ascending
};

struct PartRequest {
  size_t views = 1;  // at most
  int side = 0;      // of a window, pixels; 0: the whole picture. Smaller, down to 64, where more than `most` are seen
  int64_t most = 0;  // Gaussians wanted
};

// The spot is a random one of the Gaussians that the first view of `order` sees; the views are that one and then, in
// their order, those that see the spot, too, before those that do not. `cameras` are all views of the object, of which
// `order` has some, and `seen` knows these. `cloud` has values that are finite.
ObjectPart ChoosePart(const GaussianCloud& cloud, std::span<const Camera> cameras, std::span<const size_t> order,
                      const SeenGaussians& seen, const PartRequest& request, Random& random);

}  // namespace anchorsplat
