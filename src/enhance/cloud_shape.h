#pragma once

#include <array>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Along the principal axes of what is not far away, from the middle; the axis along which it is thinnest comes first.
struct PrincipalPlaces {
  std::array<Buffer<float>, 3> along;         // [N] each
  std::array<std::array<double, 3>, 3> axes;  // unit vectors
  std::array<double, 3> sides;                // how wide it is without a twentieth on every side
};
PrincipalPlaces AlongPrincipalAxes(const GaussianCloud& cloud);

// What a cloud and its Gaussians look like from afar. Neither unit nor orientation matters.
struct CloudShape {
  double flatness = 1;   // thickness over width along the principal axes, without a twentieth on every side
  double fill = 1;       // share of the rectangle around it, seen along its thickness, that has Gaussians: of 16 × 16
                         // cells those with a tenth of an even share
  double roundness = 0;  // of its Gaussians: median of the smallest axis over the largest

  static constexpr double kFlat = 0.2;
  bool is_flat() const { return flatness < kFlat; }
};
CloudShape ShapeOf(const GaussianCloud& cloud);

}  // namespace anchorsplat
