#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace anchorsplat {

// How long lengths are in a fit that reaches far beyond its cameras. Rates and thresholds are in scene scales; what is
// ten times as far away looks the same when it is ten times as large and moves ten times as far. Within `radius` of
// `center` nothing changes.
struct FarUnits {
  std::array<double, 3> center = {0, 0, 0};  // world
  double radius = 0;                         // world units; 0: lengths are the same everywhere

  bool any() const { return radius > 0; }

  // × the lengths of the middle, for a Gaussian at `mean` [3] world: 1 within the radius, the distance over it beyond.
  // 1 where the mean is not finite.
  double FactorAt(const float* mean) const {
    if (!any()) return 1;
    const double distance = std::hypot(mean[0] - center[0], mean[1] - center[1], mean[2] - center[2]);
    return std::isfinite(distance) ? std::max(1.0, distance / radius) : 1;
  }
};

}  // namespace anchorsplat
