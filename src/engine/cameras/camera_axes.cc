#include "cameras/camera_axes.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/text.h"

namespace anchorsplat {

namespace {

using Vec3 = std::array<double, 3>;

constexpr const char* kRemedy = R"(add "camera_axes": "opencv" next to its "frames")";

double Dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vec3 AxisOf(const Camera& camera, size_t axis) {
  const auto& r = camera.world_to_camera.rotation;
  return {r[3 * axis], r[3 * axis + 1], r[3 * axis + 2]};
}

// The point nearest to all viewing axes; none if they are nearly parallel.
std::optional<Vec3> MeetingPoint(std::span<const Camera> cameras) {
  double a[3][3] = {};
  Vec3 b{};
  const auto n = static_cast<double>(cameras.size());
  for (const Camera& camera : cameras) {
    const Vec3 forward = AxisOf(camera, 2), center = camera.Center();
    for (size_t i = 0; i < 3; ++i) {
      for (size_t k = 0; k < 3; ++k) {
        const double across = (i == k ? 1 : 0) - forward[i] * forward[k];
        a[i][k] += across / n;
        b[i] += across * center[k] / n;
      }
    }
  }
  const auto determinant = [](const double m[3][3]) {
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  };
  constexpr double kParallel = 2e-3;  // a spread of a few degrees
  const double whole = determinant(a);
  if (!(whole > kParallel)) return std::nullopt;
  Vec3 point{};
  for (size_t k = 0; k < 3; ++k) {
    double replaced[3][3];
    for (size_t i = 0; i < 3; ++i) {
      for (size_t j = 0; j < 3; ++j) replaced[i][j] = j == k ? b[i] : a[i][j];
    }
    point[k] = determinant(replaced) / whole;
  }
  return point;
}

bool AllLookAway(std::span<const Camera> cameras) {
  constexpr size_t kFewest = 3;
  constexpr double kAway = -0.7;  // cosine: within 45 degrees of facing away
  if (cameras.size() < kFewest) return false;
  const auto point = MeetingPoint(cameras);
  if (!point) return false;
  return std::ranges::all_of(cameras, [&](const Camera& camera) {
    Vec3 to{};
    const Vec3 center = camera.Center();
    for (size_t k = 0; k < 3; ++k) to[k] = (*point)[k] - center[k];
    return Dot(to, AxisOf(camera, 2)) < kAway * std::sqrt(Dot(to, to));
  });
}

// Worlds with z up are common, with z down they are not.
bool IsUprightInZ(std::span<const Camera> cameras) {
  constexpr double kUpright = 0.7;
  double up = 0;
  for (const Camera& camera : cameras) up -= AxisOf(camera, 1)[2] / static_cast<double>(cameras.size());
  return up > kUpright;
}

// Fractions of the points that the cameras see as they are, and turned around.
struct Seen {
  double read = 0, turned = 0;
};

Seen CountSeen(std::span<const Camera> cameras, std::span<const float> points) {
  constexpr size_t kMostCameras = 64, kMostPoints = 4096;
  const size_t count = points.size() / 3;
  const size_t camera_step = 1 + (cameras.size() - 1) / kMostCameras, point_step = 1 + (count - 1) / kMostPoints;
  Seen seen;
  double pairs = 0;
  for (size_t c = 0; c < cameras.size(); c += camera_step) {
    const Pinhole& k = cameras[c].intrinsics;
    for (size_t i = 0; i < count; i += point_step) {
      const float* p = points.data() + 3 * i;
      const Vec3 at = cameras[c].ToCamera({p[0], p[1], p[2]});
      if (!std::isfinite(at[2])) continue;
      ++pairs;
      const double depth = std::abs(at[2]), x = k.fx * at[0] / depth + k.cx;
      const double y = k.fy * (at[2] > 0 ? at[1] : -at[1]) / depth + k.cy;
      if (x >= 0 && x < k.width && y >= 0 && y < k.height) ++(at[2] > 0 ? seen.read : seen.turned);
    }
  }
  if (pairs > 0) seen = {seen.read / pairs, seen.turned / pairs};
  return seen;
}

}  // namespace

std::string WrongAxes(const CameraSet& set, std::span<const float> points) {
  if (set.source != CameraSource::kTransforms || set.cameras.empty()) return "";
  if (points.size() < 3) {
    if (!AllLookAway(set.cameras) || IsUprightInZ(set.cameras)) return "";
    return Cat(
        "all ", set.cameras.size(),
        " cameras face away from their common centre. If they should face it, the file uses OpenCV axes: ", kRemedy);
  }
  // Indoors, cameras facing outwards see less of the room than when turned around, but they do see some of it.
  constexpr double kEnough = 0.05, kClear = 5, kSome = 0.01;
  const Seen seen = CountSeen(set.cameras, points);
  if (seen.turned < kEnough || seen.turned < kClear * seen.read) return "";
  if (seen.read > kSome && IsUprightInZ(set.cameras)) return "";
  const auto percent = [](double part) { return Cat(Fixed(100 * part, 0), " %"); };
  return Cat("the cameras see ", percent(seen.read), " of the scene, but would see ", percent(seen.turned),
             " if they faced the other way. If the file uses OpenCV axes, ", kRemedy);
}

}  // namespace anchorsplat
