#include "core/camera.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "core/finite.h"
#include "core/text.h"
#include "core/vector3.h"

namespace anchorsplat {

namespace {

using Vec3 = std::array<double, 3>;

Vec3 Normalized(const Vec3& a) {
  const double norm = std::sqrt(Dot(a, a));
  return {a[0] / norm, a[1] / norm, a[2] / norm};
}

// Rows are the camera's axes in world coordinates; the translation puts `center` at the origin.
Pose PoseFromAxes(const Vec3& right, const Vec3& down, const Vec3& forward, const Vec3& center) {
  Pose pose;
  const std::array<Vec3, 3> rows = {right, down, forward};
  for (size_t r = 0; r < 3; ++r) {
    std::copy(rows[r].begin(), rows[r].end(), pose.rotation.begin() + static_cast<ptrdiff_t>(3 * r));
    pose.translation[r] = -Dot(rows[r], center);
  }
  return pose;
}

}  // namespace

std::array<double, 3> Camera::Center() const {
  const auto& r = world_to_camera.rotation;
  const auto& t = world_to_camera.translation;
  return {-(r[0] * t[0] + r[3] * t[1] + r[6] * t[2]), -(r[1] * t[0] + r[4] * t[1] + r[7] * t[2]),
          -(r[2] * t[0] + r[5] * t[1] + r[8] * t[2])};
}

std::array<double, 3> Camera::ToCamera(const std::array<double, 3>& p) const {
  const auto& r = world_to_camera.rotation;
  const auto& t = world_to_camera.translation;
  return {r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + t[0], r[3] * p[0] + r[4] * p[1] + r[5] * p[2] + t[1],
          r[6] * p[0] + r[7] * p[1] + r[8] * p[2] + t[2]};
}

Pose RelativeToOrigin(const Pose& world_to_camera, const WorldOrigin& origin) {
  Pose pose = world_to_camera;
  for (size_t r = 0; r < 3; ++r) {
    const double* row = pose.rotation.data() + 3 * r;
    pose.translation[r] += row[0] * origin[0] + row[1] * origin[1] + row[2] * origin[2];
  }
  return pose;
}

Camera RelativeToOrigin(Camera camera, const WorldOrigin& origin) {
  camera.world_to_camera = RelativeToOrigin(camera.world_to_camera, origin);
  return camera;
}

CameraSet RelativeToOrigin(CameraSet set, const WorldOrigin& origin) {
  for (Camera& camera : set.cameras) camera.world_to_camera = RelativeToOrigin(camera.world_to_camera, origin);
  return set;
}

WorldOrigin ChooseOrigin(const std::vector<Camera>& cameras) {
  std::vector<double> centers;
  for (const Camera& camera : cameras) {
    const auto center = camera.Center();
    centers.insert(centers.end(), center.begin(), center.end());
  }
  return ChooseOrigin(std::span<const double>(centers));
}

Pose Moved(const Pose& pose, const Similarity& move) {
  Pose moved;
  const auto &r = pose.rotation, &m = move.rotation;
  for (size_t i = 0; i < 3; ++i) {  // the camera's axes turn with the world
    for (size_t j = 0; j < 3; ++j) {
      moved.rotation[3 * i + j] = r[3 * i] * m[3 * j] + r[3 * i + 1] * m[3 * j + 1] + r[3 * i + 2] * m[3 * j + 2];
    }
  }
  Camera camera;
  camera.world_to_camera = pose;
  const Vec3 center = move.Apply(camera.Center());
  for (size_t i = 0; i < 3; ++i) moved.translation[i] = -Dot(moved.rotation.data() + 3 * i, center.data());
  return moved;
}

Pinhole Scaled(const Pinhole& intrinsics, double factor) {
  Pinhole out;
  out.width = std::max(1, static_cast<int>(std::lround(intrinsics.width * factor)));
  out.height = std::max(1, static_cast<int>(std::lround(intrinsics.height * factor)));
  const double x = static_cast<double>(out.width) / intrinsics.width;
  const double y = static_cast<double>(out.height) / intrinsics.height;
  out.fx = intrinsics.fx * x;
  out.cx = intrinsics.cx * x;
  out.fy = intrinsics.fy * y;
  out.cy = intrinsics.cy * y;
  return out;
}

Camera Crop(const Camera& camera, const PixelBox& box) {
  Camera cropped = camera;
  cropped.intrinsics.width = box.x1 - box.x0;
  cropped.intrinsics.height = box.y1 - box.y0;
  cropped.intrinsics.cx -= box.x0;
  cropped.intrinsics.cy -= box.y0;
  return cropped;
}

Result<Pose> LookAt(const Vec3& center, const Vec3& target, const Vec3& up) {
  const Vec3 along = {target[0] - center[0], target[1] - center[1], target[2] - center[2]};
  if (!AllFinite(along) || !AllFinite(up)) return Error{ErrorCode::kBadArgument, "camera position is not finite"};
  if (Dot(along, along) == 0) return Error{ErrorCode::kBadArgument, "camera stands on the point it looks at"};
  const Vec3 forward = Normalized(along);
  Vec3 right = Cross(forward, up);
  // Looking along `up`: any axis that is not parallel will do; take the one least aligned with the view.
  if (Dot(right, right) < 1e-12 * Dot(up, up) || Dot(up, up) == 0) {
    Vec3 other = {0, 0, 0};
    const auto least =
        std::min_element(forward.begin(), forward.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
    other[static_cast<size_t>(least - forward.begin())] = 1;
    right = Cross(forward, other);
  }
  right = Normalized(right);
  return PoseFromAxes(right, Cross(forward, right), forward, center);
}

namespace {

// Describes how a matrix deviates from a rotation (scales, mirrors or both); empty for other deviations.
std::string WhatIsWrong(const Vec3& right, const Vec3& up, const Vec3& back, double tolerance) {
  const double scale = std::sqrt(Dot(right, right)), area = scale * scale;
  if (!(scale > 0)) return "";
  const double off = std::max({std::abs(Dot(up, up) - area), std::abs(Dot(back, back) - area), std::abs(Dot(right, up)),
                               std::abs(Dot(right, back)), std::abs(Dot(up, back))});
  if (off > tolerance * area) return "";
  const bool mirrored = Dot(Cross(right, up), back) < 0;
  if (std::abs(scale - 1) <= tolerance) return mirrored ? "it mirrors: its determinant is -1" : "";
  return Cat("it scales by ", scale, mirrored ? " and mirrors" : "");
}

}  // namespace

Result<Pose> PoseFromOpenGlCameraToWorld(const std::array<double, 16>& m) {
  if (!AllFinite(m)) return Error{ErrorCode::kBadArgument, "camera matrix has a value that is not finite"};
  const Vec3 right = {m[0], m[4], m[8]};
  const Vec3 up = {m[1], m[5], m[9]};
  const Vec3 back = {m[2], m[6], m[10]};
  constexpr double kTolerance = 1e-3;  // files with six digits pass, scaled or sheared matrices do not
  const double off = std::max({std::abs(Dot(right, right) - 1), std::abs(Dot(up, up) - 1),
                               std::abs(Dot(back, back) - 1), std::abs(Dot(right, up)), std::abs(Dot(right, back)),
                               std::abs(Dot(up, back)), std::abs(Dot(Cross(right, up), back) - 1)});
  if (off > kTolerance) {
    const std::string wrong = WhatIsWrong(right, up, back, kTolerance);
    return Error{ErrorCode::kBadArgument,
                 Cat("camera matrix is not a rotation (", wrong.empty() ? Cat("off by ", off) : wrong, ")")};
  }
  return PoseFromAxes(right, {-up[0], -up[1], -up[2]}, {-back[0], -back[1], -back[2]}, {m[3], m[7], m[11]});
}

std::array<double, 16> OpenGlCameraToWorld(const Pose& pose) {
  const auto& r = pose.rotation;
  Camera camera;
  camera.world_to_camera = pose;
  const Vec3 c = camera.Center();
  return {r[0], -r[3], -r[6], c[0], r[1], -r[4], -r[7], c[1], r[2], -r[5], -r[8], c[2], 0, 0, 0, 1};
}

Result<CameraSet> OrbitCameras(int count, double radius, const Vec3& target, const Pinhole& intrinsics) {
  if (count < 1) return Error{ErrorCode::kBadArgument, "an orbit needs at least one view"};
  if (!(radius > 0) || !std::isfinite(radius)) {
    return Error{ErrorCode::kBadArgument, Cat("orbit radius ", radius, " is not positive")};
  }
  CameraSet set;
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  for (int i = 0; i < count; ++i) {
    const double y = 1 - 2 * (i + 0.5) / count;  // +½ keeps clear of the poles
    const double ring = std::sqrt(1 - y * y);
    const Vec3 center = {target[0] + radius * ring * std::cos(golden * i), target[1] + radius * y,
                         target[2] + radius * ring * std::sin(golden * i)};
    Camera camera;
    char name[16];
    std::snprintf(name, sizeof name, "%03d", i);
    camera.name = name;
    camera.intrinsics = intrinsics;
    ANCHORSPLAT_ASSIGN_OR_RETURN(camera.world_to_camera, LookAt(center, target, {0, 1, 0}));
    set.cameras.push_back(std::move(camera));
  }
  return set;
}

Pinhole PinholeFromFov(int width, int height, double fov_x) {
  const double focal = 0.5 * width / std::tan(0.5 * fov_x);
  return {width, height, focal, focal, 0.5 * width, 0.5 * height};
}

}  // namespace anchorsplat
