#include "core/world_up.h"

#include <cmath>

#include "core/vector3.h"

namespace anchorsplat {

namespace {

using Vec3 = std::array<double, 3>;

constexpr double kAlmostAnAxis = 0.93;  // cosine of 21°: nobody holds a camera level on average to the degree

}  // namespace

std::optional<Vec3> WorldUp(std::span<const Camera> cameras) {
  Vec3 sum{};
  for (const Camera& camera : cameras) {
    for (size_t k = 0; k < 3; ++k) sum[k] -= camera.world_to_camera.rotation[3 + k];  // its y points down
  }
  // Cameras held in all directions have no common up.
  const std::optional<Vec3> mean = UnitVector(sum, 0.1 * static_cast<double>(cameras.size()));
  if (!mean) return std::nullopt;
  size_t largest = 0;
  for (size_t k = 1; k < 3; ++k) {
    if (std::abs((*mean)[k]) > std::abs((*mean)[largest])) largest = k;
  }
  if (std::abs((*mean)[largest]) < kAlmostAnAxis) return mean;
  Vec3 axis{};
  axis[largest] = (*mean)[largest] > 0 ? 1 : -1;
  return axis;
}

void TurnUp(const Vec3& target, const Vec3& up, std::vector<Camera>& cameras) {
  const std::optional<Vec3> unit = UnitVector(up, 0);
  if (!unit || *unit == Vec3{0, 1, 0}) return;
  const Vec3& y = *unit;
  // Columns of the rotation: the images of x, y and z. x moves as little as possible.
  const Vec3 start = std::abs(y[0]) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 0, 1};
  const double along = Dot(start, y);
  const Vec3 x = *UnitVector({start[0] - along * y[0], start[1] - along * y[1], start[2] - along * y[2]}, 0);
  const Vec3 z = Cross(x, y);
  for (Camera& camera : cameras) {
    Pose& pose = camera.world_to_camera;
    const Pose old = pose;
    for (size_t r = 0; r < 3; ++r) {
      const double* row = old.rotation.data() + 3 * r;
      for (size_t k = 0; k < 3; ++k) {
        pose.rotation[3 * r + k] = row[0] * x[k] + row[1] * y[k] + row[2] * z[k];
      }
      for (size_t k = 0; k < 3; ++k) {
        pose.translation[r] += (old.rotation[3 * r + k] - pose.rotation[3 * r + k]) * target[k];
      }
    }
  }
}

Result<CameraSet> UprightOrbit(int count, double radius, const Vec3& target, const Vec3& up,
                               const Pinhole& intrinsics) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(CameraSet orbit, OrbitCameras(count, radius, target, intrinsics));
  TurnUp(target, up, orbit.cameras);
  return orbit;
}

}  // namespace anchorsplat
