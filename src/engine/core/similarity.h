#pragma once

#include <array>

namespace anchorsplat {

// Similarity transform of world points: p ↦ scale · rotation · p + translation.
struct Similarity {
  std::array<double, 9> rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};  // row-major
  std::array<double, 3> translation = {0, 0, 0};
  double scale = 1;  // positive

  std::array<double, 3> Apply(const std::array<double, 3>& p) const;
  friend bool operator==(const Similarity&, const Similarity&) = default;
};

Similarity Inverse(const Similarity& s);
// p ↦ outer(inner(p)).
Similarity Compose(const Similarity& outer, const Similarity& inner);

}  // namespace anchorsplat
