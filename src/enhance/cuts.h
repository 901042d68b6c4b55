#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Where a cloud was cut: people crop captures by boxes, balls and lassos. A cut takes Gaussians by their centres, so
// that centres end sharply there and the Gaussians themselves stick out of it, as large as they happen to be. Where a
// surface ends by itself, Gaussians end together, and so the centres of large ones lie farther inside.
struct Cut {
  bool ball = false;
  std::array<double, 3> direction{};  // plane: unit normal, out of the cloud. Ball: its middle, world units
  double reach = 0;                   // plane: largest direction · x that was left. Ball: radius

  // How far inside a Gaussian's centre lies, in its own standard deviations across the cut.
  double Depth(const GaussianCloud& cloud, int64_t i) const;
};

// Planes and at most one ball that cut it, by the Gaussians of 10 % opacity and more. Only where the cloud's convex
// hull shows: a hole that was cut is not found. Scales, turns and moves with the cloud; nothing for fewer than 64.
std::vector<Cut> FindCuts(const GaussianCloud& cloud);

// Depth up to which a Gaussian may make an outline that is the cut's.
inline constexpr double kCutReach = 3;

}  // namespace anchorsplat
