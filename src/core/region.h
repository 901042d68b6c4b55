#pragma once

#include <array>
#include <optional>

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

}  // namespace anchorsplat
