#pragma once

#include <cstdint>
#include <vector>

#include "core/gaussian_cloud.h"

namespace anchorsplat {

// The Gaussians of a cloud that say something about its fit: usable, of an opacity of 10 % or more and near the middle
// of the cloud; those nearest to it where there are more than 200,000. Ascending rows.
struct ShowingGaussians {
  std::vector<int64_t> all;
  // Without those that are nearly black: fits on black keep black ones around the object that no picture shows. The
  // same as `all` where fewer than 16 are not black.
  std::vector<int64_t> bright;
  std::vector<int64_t> not_black;  // of the whole cloud, usable, visible or not
};
ShowingGaussians FindShowingGaussians(const GaussianCloud& cloud);

double SquaredDistance(const float* a, const float* b);  // of two points of three coordinates

}  // namespace anchorsplat
