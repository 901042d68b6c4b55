#pragma once

#include <array>

#include "core/camera.h"
#include "core/cloud_view.h"

namespace anchorsplat {

// Where to look from when nobody says: the centre of the box that holds the middle 98 % of the visible Gaussians'
// means along each axis (of more than a million, of every so many), and the radius of the sphere around that centre
// that holds 98 % of them. Where that is a point, the radius is what its largest Gaussian shows (3 σ); 1 where that has
// no extent either.
struct Framing {
  std::array<double, 3> target = {0, 0, 0};  // world
  double radius = 1;                         // world; always positive
};
Framing FrameCloud(const CloudView& cloud);

// Distance from which a sphere of `radius` fills the smaller side of the image, with a tenth to spare.
double FramingDistance(const Framing& framing, const Pinhole& intrinsics);

}  // namespace anchorsplat
