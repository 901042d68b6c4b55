#include "scene/camera_rig.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "core/random.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr int kMostViews = 100000;
using Direction3 = std::array<double, 3>;

std::string NumberedName(int i, int count) {
  const std::string number = std::to_string(i);
  const size_t digits = std::max<size_t>(3, std::to_string(count - 1).size());
  return std::string(digits - number.size(), '0') + number;
}

// View directions of the rings. Ring r gets views r, r + rings, …, so that any prefix is spread out.
std::vector<Direction3> RingDirections(const CameraRig& rig) {
  std::vector<Direction3> out;
  const int rings = static_cast<int>(rig.elevations.size());
  for (int i = 0; i < rig.views; ++i) {
    const int ring = i % rings;
    const int on_ring = (rig.views - ring + rings - 1) / rings;
    const double turn = (i / rings + static_cast<double>(ring) / rings) / on_ring;
    const double azimuth = 2 * std::numbers::pi * turn;
    const double elevation = rig.elevations[static_cast<size_t>(ring)] * std::numbers::pi / 180;
    out.push_back(
        {std::cos(elevation) * std::cos(azimuth), std::sin(elevation), std::cos(elevation) * std::sin(azimuth)});
  }
  return out;
}

std::vector<Direction3> RandomDirections(const CameraRig& rig) {
  Random random(rig.seed);
  std::vector<Direction3> out;
  for (int i = 0; i < rig.views; ++i) {
    const double y = random.Uniform(-1, 1);
    const double azimuth = random.Uniform(0, 2 * std::numbers::pi);
    const double ring = std::sqrt(1 - y * y);
    out.push_back({ring * std::cos(azimuth), y, ring * std::sin(azimuth)});
  }
  return out;
}

Status Check(const CameraRig& rig) {
  if (rig.views < 1 || rig.views > kMostViews) {
    return Error{ErrorCode::kBadArgument, Cat("a rig must have 1 to ", kMostViews, " views, not ", rig.views)};
  }
  if (!(rig.radius > 0) || !std::isfinite(rig.radius)) {
    return Error{ErrorCode::kBadArgument, Cat("the cameras' distance ", rig.radius, " is not positive")};
  }
  if (!(rig.fov_degrees > 0 && rig.fov_degrees < 180)) {
    return Error{ErrorCode::kBadArgument, Cat("field of view ", rig.fov_degrees, " is not between 0 and 180 degrees")};
  }
  if (rig.kind == RigKind::kRings && rig.elevations.empty()) {
    return Error{ErrorCode::kBadArgument, "rings need at least one elevation"};
  }
  for (const double elevation : rig.elevations) {
    if (!(std::abs(elevation) <= 90)) {
      return Error{ErrorCode::kBadArgument, Cat("elevation ", elevation, " is not between -90 and 90 degrees")};
    }
  }
  return {};
}

}  // namespace

Result<CameraSet> MakeRig(const CameraRig& rig, int width, int height) {
  ANCHORSPLAT_RETURN_IF_ERROR(Check(rig));
  const Pinhole intrinsics = PinholeFromFov(width, height, rig.fov_degrees * std::numbers::pi / 180);
  CameraSet set;
  if (rig.kind == RigKind::kSphere) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(set, OrbitCameras(rig.views, rig.radius, {0, 0, 0}, intrinsics));
  } else {
    for (const Direction3& d : rig.kind == RigKind::kRings ? RingDirections(rig) : RandomDirections(rig)) {
      Camera camera;
      camera.intrinsics = intrinsics;
      ANCHORSPLAT_ASSIGN_OR_RETURN(
          camera.world_to_camera,
          LookAt({rig.radius * d[0], rig.radius * d[1], rig.radius * d[2]}, {0, 0, 0}, {0, 1, 0}));
      set.cameras.push_back(std::move(camera));
    }
  }
  for (int i = 0; i < rig.views; ++i) set.cameras[static_cast<size_t>(i)].name = NumberedName(i, rig.views);
  return set;
}

}  // namespace anchorsplat
