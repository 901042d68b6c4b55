#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "core/camera.h"

namespace anchorsplat {

// Where up is in a splat's world. The files of the field do not say; most captures have y down, as their first camera
// had it. What a splat's comments say of it: core/splat_comments.h.
inline constexpr std::array<double, 3> kUsualUp = {0, -1, 0};

// What the cameras hold upright on average: an axis where that is almost it. Nothing without cameras, or where their
// ups cancel out.
std::optional<std::array<double, 3>> WorldUp(std::span<const Camera> cameras);

// OrbitCameras (core/camera.h) that hold `up` upright.
Result<CameraSet> UprightOrbit(int count, double radius, const std::array<double, 3>& target,
                               const std::array<double, 3>& up, const Pinhole& intrinsics);

// Turns the cameras about `target` so that what was +y becomes `up` (of any length but 0).
void TurnUp(const std::array<double, 3>& target, const std::array<double, 3>& up, std::vector<Camera>& cameras);

}  // namespace anchorsplat
