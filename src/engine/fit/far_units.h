#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace anchorsplat {

// Scale of lengths by distance, for fits that reach far beyond their cameras. Rates and thresholds are in scene scales,
// but something ten times as far looks the same if it is ten times as large and moves ten times as far. Inside `radius`
// around `center` nothing changes.
struct FarUnits {
  std::array<double, 3> center = {0, 0, 0};  // world
  double radius = 0;                         // world units; 0: lengths are the same everywhere

  bool any() const { return radius > 0; }

  // Factor on lengths for a Gaussian at `mean` [3] world: 1 within the radius, distance / radius beyond. 1 for a
  // non-finite mean.
  double FactorAt(const float* mean) const {
    if (!any()) return 1;
    const double distance = std::hypot(mean[0] - center[0], mean[1] - center[1], mean[2] - center[2]);
    return std::isfinite(distance) ? std::max(1.0, distance / radius) : 1;
  }
};

}  // namespace anchorsplat
