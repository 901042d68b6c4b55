#pragma once

#include <cstdint>
#include <vector>

#include "core/camera.h"
#include "core/result.h"

namespace anchorsplat {

enum class RigKind {
  kSphere,  // Fibonacci sphere: evenly spread, the same on every machine (OrbitCameras)
  kRings,   // evenly spaced on circles around the vertical axis at given elevations, each rotated against the one below
  kRandom,  // uniform on the sphere, by seed
};

// Cameras on a sphere looking at the origin, y up. Defaults are those of the 3DGS-SR benchmark as far as known (146
// views) and frame an object of unit size.
struct CameraRig {
  RigKind kind = RigKind::kSphere;
  int views = 146;
  double radius = 1.7;
  double fov_degrees = 45;                        // horizontal
  std::vector<double> elevations = {-30, 0, 30};  // rings: degrees above the horizon
  uint64_t seed = 0;                              // random
};

// The rig's views at `width` × `height` pixels, named "000", "001", … in order (four digits from 1000 views, so that
// names sort). Errors (kBadArgument): no views or more than 100,000; radius not positive; field of view not in (0°,
// 180°); an elevation beyond ±90°.
Result<CameraSet> MakeRig(const CameraRig& rig, int width, int height);

}  // namespace anchorsplat
