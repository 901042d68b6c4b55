#include "enhance/camera_rule.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "core/statistics.h"
#include "core/text.h"
#include "core/vector3.h"

namespace anchorsplat {

namespace {

using Vector = std::array<double, 3>;

constexpr size_t kLeastCameras = 8;
constexpr float kMostDistant =
    1.6f;  // distance of the farthest (95 %) over the nearest (5 %) camera; likewise for pixels
constexpr float kMostAside = 0.2f;  // miss distance of an axis (90 % of them) over the distance from the point
constexpr double kLeastInFront = 0.95;
// Length of the mean direction to the cameras: 0 all around, ½ for a hemisphere or a ring at 30°, 1 for a single place.
constexpr double kMostOneSided = 0.85;
// Share of the visible Gaussians that must be closer to the point than kInside of the cameras' distance. Beyond that,
// pixels on the near side are half as large as at the centre, and the median also covers views from behind.
constexpr double kLeastInside = 0.9, kInside = 0.5;
constexpr float kVisibleLogit = -2.2f;  // opacity 0.1

double Norm(const Vector& a) { return std::sqrt(Dot(a, a)); }

// Viewing direction: third row of the rotation.
Vector AxisOf(const Camera& camera) {
  const auto& r = camera.world_to_camera.rotation;
  return {r[6], r[7], r[8]};
}

// The point with the smallest sum of squared distances to all axes; unset if they are (nearly) parallel.
std::optional<Vector> NearestToAxes(const std::vector<Camera>& cameras) {
  std::array<Vector, 3> m{};  // Σ (I − d dᵀ)
  Vector b{};                 // Σ (I − d dᵀ) c
  for (const Camera& camera : cameras) {
    const Vector d = AxisOf(camera), c = camera.Center();
    const double along = Dot(d, c);
    for (size_t i = 0; i < 3; ++i) {
      for (size_t j = 0; j < 3; ++j) m[i][j] += (i == j ? 1.0 : 0.0) - d[i] * d[j];
      b[i] += c[i] - d[i] * along;
    }
  }
  const Vector c12 = Cross(m[1], m[2]), c20 = Cross(m[2], m[0]), c01 = Cross(m[0], m[1]);
  const double determinant = Dot(m[0], c12);
  const auto n = static_cast<double>(cameras.size());
  if (!(determinant > 1e-4 * n * n * n)) return std::nullopt;
  Vector x;
  for (size_t i = 0; i < 3; ++i) x[i] = (c12[i] * b[0] + c20[i] * b[1] + c01[i] * b[2]) / determinant;
  return x;
}

}  // namespace

CameraRuleChoice ChooseCameraRule(const GaussianCloud& cloud, const CameraSet& set) {
  const std::vector<Camera>& cameras = set.cameras;
  const auto smallest = [](std::string why) { return CameraRuleChoice{CameraPixelRule::kSmallest, std::move(why)}; };
  if (cameras.size() < kLeastCameras) return smallest(Cat("there are only ", cameras.size(), " cameras"));
  const std::optional<Vector> point = NearestToAxes(cameras);
  if (!point) return smallest("all cameras face the same way");

  Buffer<float> distances, pixels, asides;
  Vector mean{};
  size_t in_front = 0;
  for (const Camera& camera : cameras) {
    const Vector to = Minus(*point, camera.Center());
    const double distance = Norm(to), along = Dot(to, AxisOf(camera));
    if (!(distance > 0) || !std::isfinite(distance)) return smallest("the cameras do not face one point");
    if (along > 0) ++in_front;
    distances.push_back(static_cast<float>(distance));
    pixels.push_back(static_cast<float>(distance / std::sqrt(camera.intrinsics.fx * camera.intrinsics.fy)));
    asides.push_back(static_cast<float>(std::sqrt(std::max(0.0, 1 - std::pow(along / distance, 2)))));
    for (size_t a = 0; a < 3; ++a) mean[a] += to[a] / distance / static_cast<double>(cameras.size());
  }
  if (static_cast<double>(in_front) < kLeastInFront * static_cast<double>(cameras.size()) ||
      Quantile(asides, 0.9) > kMostAside) {
    return smallest("the cameras do not face one point");
  }
  if (Norm(mean) > kMostOneSided) return smallest("all cameras are on one side of the subject");
  const float near = Quantile(distances, 0.05), far = Quantile(distances, 0.95), typical = Quantile(distances, 0.5);
  if (far > kMostDistant * near) {
    return smallest(Cat("some cameras are ", Fixed(far / near, 1), " times closer to the subject than others"));
  }

  // Zoom may vary at the same distance.
  const float finest = Quantile(pixels, 0.05), coarsest = Quantile(pixels, 0.95);
  if (coarsest > kMostDistant * finest) {
    return smallest(Cat("some cameras have ", Fixed(coarsest / finest, 1), " times smaller pixels than others"));
  }

  int64_t visible = 0, inside = 0;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (!IsUsable(cloud, i) || cloud.opacity_logits[static_cast<size_t>(i)] < kVisibleLogit) continue;
    const float* p = cloud.means.data() + 3 * i;
    ++visible;
    if (Norm(Minus(Vector{p[0], p[1], p[2]}, *point)) < kInside * typical) ++inside;
  }
  if (static_cast<double>(inside) < kLeastInside * static_cast<double>(visible)) {
    return smallest("much of the splat is closer to the cameras than to the subject");
  }
  return {CameraPixelRule::kMedian, "the cameras surround the subject"};
}

}  // namespace anchorsplat
