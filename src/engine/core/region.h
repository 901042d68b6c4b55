#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "core/world_origin.h"

namespace anchorsplat {

// A part of space in world units: a box, or a sphere around `low`.
struct Region {
  std::array<double, 3> low{}, high{};  // the box's corners; of a sphere `low` is the centre
  std::optional<double> radius = std::nullopt;

  // Whether a point lies in it or on its border; NaN lies nowhere.
  bool Holds(const float* point) const {
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

// The region in a world that begins at `origin` (core/world_origin.h).
Region FromOrigin(Region region, const WorldOrigin& origin);

// Four numbers are a sphere, its centre and a radius above 0, six a box by any two corners across. Nothing: any other
// count, a value that is not finite, a radius that is not positive.
std::optional<Region> RegionOf(std::span<const double> numbers);
inline constexpr const char* kNoRegion =
    " is neither a box X0,Y0,Z0,X1,Y1,Z1 nor a sphere X,Y,Z,RADIUS, such as 0,0.5,0,2";  // for messages

}  // namespace anchorsplat
