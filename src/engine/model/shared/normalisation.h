#pragma once

#include <array>
#include <span>

#include "core/result.h"

namespace anchorsplat {

// How a cloud is brought into the cube [0,1]³ that the network knows.
enum class NormalisationMode {
  kAuto,      // kCentered when the box's centre is within a tenth of the largest coordinate from the origin, else kBbox
  kCentered,  // the origin goes to the middle, the largest coordinate to a face
  kBbox,      // the box's centre goes to the middle, its longest side to an edge
  kUnit,      // [−1,1]³ to [0,1]³, whatever the cloud
};

// x' = x · scale + shift per axis in two rounded fp32 steps, never fused: which Gaussians round to just outside the
// cube depends on it. log-scales move by ln(scale).
struct Normalisation {
  float scale = 1;
  std::array<float, 3> shift = {0, 0, 0};
  NormalisationMode mode = NormalisationMode::kUnit;  // the one that was used, never kAuto

  float Apply(float x, size_t axis) const { return x * scale + shift[axis]; }
  float Undo(float x, size_t axis) const { return (x - shift[axis]) / scale; }
  float LogScale() const;  // ln(scale)
};

// From the means [N,3], all finite. The arithmetic is that of AnchorSplat's release, operation by operation.
// Errors (kBadArgument): no Gaussians; all of them at one place; for kCentered and kUnit, all of them at the origin.
Result<Normalisation> FitNormalisation(std::span<const float> means, NormalisationMode mode);

}  // namespace anchorsplat
