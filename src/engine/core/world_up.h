#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/camera.h"

namespace anchorsplat {

// Where up is in a splat's world. The files of the field do not say; most captures have y down, as their first camera
// had it.
inline constexpr std::array<double, 3> kUsualUp = {0, -1, 0};

// What the cameras hold upright on average: an axis where that is almost it. Nothing without cameras, or where their
// ups cancel out.
std::optional<std::array<double, 3>> WorldUp(std::span<const Camera> cameras);

// The comment by which a splat of ours says where up is (GaussianCloud::comments).
std::string UpComment(const std::array<double, 3>& up);
// What comments say of it: a unit vector. Ours count before those of other programs, "Vertical axis: z" as nerfstudio
// has it, or three numbers, or an axis with its sign. Nothing where there is none or a broken one, nor for the bare
// "Vertical axis: y": Brush writes that whatever its splat, and the usual up lies along this axis anyway.
std::optional<std::array<double, 3>> UpOf(const std::vector<std::string>& comments);
// Leaves no other word of it in them.
void SetUp(const std::array<double, 3>& up, std::vector<std::string>& comments);
// Rewrites them for a world that is turned or mirrored by the orthogonal `matrix` (row-major), in our words.
void TurnUpComments(const std::array<double, 9>& matrix, std::vector<std::string>& comments);

// OrbitCameras (core/camera.h) that hold `up` upright.
Result<CameraSet> UprightOrbit(int count, double radius, const std::array<double, 3>& target,
                               const std::array<double, 3>& up, const Pinhole& intrinsics);

// Turns the cameras about `target` so that what was +y becomes `up` (of any length but 0).
void TurnUp(const std::array<double, 3>& target, const std::array<double, 3>& up, std::vector<Camera>& cameras);

}  // namespace anchorsplat
