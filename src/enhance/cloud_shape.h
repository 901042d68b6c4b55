#pragma once

#include "core/gaussian_cloud.h"

namespace anchorsplat {

// What a cloud and its Gaussians look like from afar. Neither unit nor orientation matters.
struct CloudShape {
  double flatness = 1;   // thickness over width along the principal axes, without a twentieth on every side
  double fill = 1;       // share of the rectangle around it, seen along its thickness, that has Gaussians: of 16 × 16
                         // cells those with a tenth of an even share
  double roundness = 0;  // of its Gaussians: median of the smallest axis over the largest
};
CloudShape ShapeOf(const GaussianCloud& cloud);

}  // namespace anchorsplat
