#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "core/world_origin.h"

namespace anchorsplat {

// A region of space in world units: a box, or a sphere around `low`.
struct Region {
  std::array<double, 3> low{}, high{};  // corners of the box; `low` is the centre of a sphere
  std::optional<double> radius = std::nullopt;

  // Whether a point lies inside or on the border; false for NaN.
  bool Contains(const float* point) const {
    double square = 0;
    bool inside = true;
    for (size_t c = 0; c < 3; ++c) {
      const double d = double{point[c]} - low[c];
      square += d * d;
      inside = inside && point[c] >= low[c] && point[c] <= high[c];
    }
    return radius ? square <= *radius * *radius : inside;
  }
};

// The region in coordinates relative to `origin` (core/world_origin.h).
Region RelativeToOrigin(Region region, const WorldOrigin& origin);

// Region from four numbers (centre and radius > 0 of a sphere) or six (any two opposite corners of a box). None for
// another count, a value that is not finite, or a radius that is not positive.
std::optional<Region> RegionOf(std::span<const double> numbers);
inline constexpr const char* kNoRegion =
    " is neither a box X0,Y0,Z0,X1,Y1,Z1 nor a sphere X,Y,Z,RADIUS, such as 0,0.5,0,2";  // rest of an error message

}  // namespace anchorsplat
