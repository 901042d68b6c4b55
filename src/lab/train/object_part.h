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

// A window of at most `side` pixels in a picture, around a random pixel of the object's box.
PixelBox RandomWindow(int width, int height, const PixelBox& object, int side, Random& random);

// A part of an object for one step: the same spot from several sides.
struct ObjectPart {
  std::vector<size_t> views;      // indices of the object's views
  std::vector<PixelBox> windows;  // in each view, around the spot
  std::vector<int64_t>
      wanted;  // Gaussians visible in a window, ascending; the nearest to the spot if there are too many
  std::vector<int64_t> others;  // further ones that may be visible in a window, ascending
};

struct PartRequest {
  size_t views = 1;  // maximum
  int side = 0;      // of a window, pixels; 0: the whole picture. Reduced, down to 64, if more than `most` are visible
  int64_t most = 0;  // maximum number of wanted Gaussians
};

// Picks a random Gaussian visible in the first view of `order` as the spot. Uses that view, then others in order, those
// that see the spot first. `cameras`: all views of the object; `order`: some of them, known to `seen`. `cloud` must be
// finite.
ObjectPart ChoosePart(const GaussianCloud& cloud, std::span<const Camera> cameras, std::span<const size_t> order,
                      const SeenGaussians& seen, const PartRequest& request, Random& random);

}  // namespace anchorsplat
