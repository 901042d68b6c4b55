#pragma once

#include <array>
#include <span>

#include "core/result.h"

namespace anchorsplat {

// How a cloud is mapped into the network's cube [0,1]³.
enum class NormalisationMode {
  kAuto,      // kCentered if the box's centre is within a tenth of the largest coordinate from the origin, else kBbox
  kCentered,  // origin to the cube's centre, largest coordinate to a face
  kBbox,      // box centre to the cube's centre, longest side to the cube's side
  kUnit,      // [−1,1]³ to [0,1]³, regardless of the cloud
};

// x' = x · scale + shift per axis, as two rounded fp32 operations, never fused: rounding decides which Gaussians land
// just outside the cube. Log-scales shift by ln(scale).
struct Normalisation {
  float scale = 1;
  std::array<float, 3> shift = {0, 0, 0};
  NormalisationMode mode = NormalisationMode::kUnit;  // the mode used, never kAuto

  float Apply(float x, size_t axis) const { return x * scale + shift[axis]; }
  float Undo(float x, size_t axis) const { return (x - shift[axis]) / scale; }
  float LogScale() const;  // ln(scale)
};

// Fits the normalisation to finite means [N,3], world units. Repeats the arithmetic of AnchorSplat's release exactly.
// Errors (kBadArgument): no Gaussians; all at one point; for kCentered and kUnit, all at the origin.
Result<Normalisation> FitNormalisation(std::span<const float> means, NormalisationMode mode);

}  // namespace anchorsplat
