#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "core/camera.h"

namespace anchorsplat {

// Up direction of a splat's world. File formats of the field do not record it; most captures have y down, as their
// first camera had. For comments about it see core/splat_comments.h.
inline constexpr std::array<double, 3> kUsualUp = {0, -1, 0};

// Average up of the cameras, snapped to an axis if it is close to one. None without cameras, or if their ups cancel
// out.
std::optional<std::array<double, 3>> WorldUp(std::span<const Camera> cameras);

// OrbitCameras (core/camera.h) with `up` as the world's up.
Result<CameraSet> UprightOrbit(int count, double radius, const std::array<double, 3>& target,
                               const std::array<double, 3>& up, const Pinhole& intrinsics);

// Rotates the cameras around `target` so that +y becomes `up` (any non-zero length).
void TurnUp(const std::array<double, 3>& target, const std::array<double, 3>& up, std::vector<Camera>& cameras);

}  // namespace anchorsplat
