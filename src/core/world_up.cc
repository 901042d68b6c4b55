#include "core/world_up.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/number_text.h"
#include "core/text.h"
#include "core/vector3.h"

namespace anchorsplat {

namespace {

using Vec3 = std::array<double, 3>;

constexpr std::string_view kMark = "world up: ";
constexpr double kAlmostAnAxis = 0.93;  // cosine of 21°: nobody holds a camera level on average to the degree

double Length(const Vec3& v) { return std::hypot(v[0], v[1], v[2]); }

std::optional<Vec3> Unit(const Vec3& v, double least) {
  const double length = Length(v);
  if (!(length > least) || !std::isfinite(length)) return std::nullopt;
  return Vec3{v[0] / length, v[1] / length, v[2] / length};
}

std::optional<Vec3> ParseComment(std::string_view text) {
  if (!text.starts_with(kMark)) return std::nullopt;
  text.remove_prefix(kMark.size());
  Vec3 up{};
  for (double& x : up) {
    text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
    const auto [end, code] = FromChars(text.data(), text.data() + text.size(), x);
    if (code != std::errc()) return std::nullopt;
    text.remove_prefix(static_cast<size_t>(end - text.data()));
  }
  return text.empty() ? Unit(up, 0) : std::nullopt;
}

}  // namespace

std::optional<Vec3> WorldUp(std::span<const Camera> cameras) {
  Vec3 sum{};
  for (const Camera& camera : cameras) {
    for (size_t k = 0; k < 3; ++k) sum[k] -= camera.world_to_camera.rotation[3 + k];  // its y points down
  }
  // Cameras held every way have no up in common.
  const std::optional<Vec3> mean = Unit(sum, 0.1 * static_cast<double>(cameras.size()));
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

std::string UpComment(const Vec3& up) { return Cat(kMark, up[0], " ", up[1], " ", up[2]); }

std::optional<Vec3> UpOf(const std::vector<std::string>& comments) {
  for (const std::string& comment : comments) {
    if (const auto up = ParseComment(comment)) return up;
  }
  return std::nullopt;
}

void FlipUp(const std::array<float, 3>& signs, std::vector<std::string>& comments) {
  for (std::string& comment : comments) {
    auto up = ParseComment(comment);
    if (!up) continue;
    for (size_t k = 0; k < 3; ++k) (*up)[k] = signs[k] < 0 && (*up)[k] != 0 ? -(*up)[k] : (*up)[k];
    comment = UpComment(*up);
  }
}

void TurnUp(const Vec3& target, const Vec3& up, std::vector<Camera>& cameras) {
  const std::optional<Vec3> unit = Unit(up, 0);
  if (!unit || *unit == Vec3{0, 1, 0}) return;
  const Vec3& y = *unit;
  // The columns of the rotation: where x, y and z go. x stays as near to itself as it can.
  const Vec3 start = std::abs(y[0]) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 0, 1};
  const double along = Dot(start, y);
  const Vec3 x = *Unit({start[0] - along * y[0], start[1] - along * y[1], start[2] - along * y[2]}, 0);
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
