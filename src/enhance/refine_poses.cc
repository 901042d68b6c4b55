#include "enhance/refine_poses.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/framing.h"
#include "core/image.h"
#include "core/parallel.h"
#include "core/rotation.h"
#include "core/text.h"
#include "fit/random_streams.h"
#include "formats/quantize.h"

namespace anchorsplat {

namespace {

constexpr double kPoseFieldOfView = std::numbers::pi / 4;
constexpr int kSmallestSide = 32;    // pixels: less says nothing, and SSIM's window needs 11
constexpr float kOpaque = 0.1f;      // a Gaussian that hides something
constexpr double kRoom = 0.05;       // of the distance to the object: nothing opaque may be nearer to a camera
constexpr double kSigmas = 3;        // and the camera may not be within a Gaussian
constexpr double kSameWay = 0.7071;  // cosine of 45°
constexpr double kSameFocal = 1e-3;  // relative

using Vec3 = std::array<double, 3>;

// Whether something opaque is around `center`.
bool IsObstructed(const GaussianCloud& cloud, const Vec3& center, double room) {
  std::atomic<bool> obstructed{false};
  ParallelFor(0, cloud.size(), 1 << 15, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last && !obstructed; ++i) {
      const float* p = cloud.means.data() + 3 * i;
      const float* s = cloud.log_scales.data() + 3 * i;
      const double distance = std::hypot(p[0] - center[0], p[1] - center[1], p[2] - center[2]);
      const double reach = std::max(room, kSigmas * std::exp(double{std::max({s[0], s[1], s[2]})}));
      // The bound by the largest axis is rough, but only for Gaussians nearly as large as the object.
      if (distance < reach && Sigmoid(cloud.opacity_logits[static_cast<size_t>(i)]) > kOpaque) obstructed = true;
    }
  });
  return obstructed;
}

Vec3 Forward(const Camera& camera) {
  const auto& r = camera.world_to_camera.rotation;
  return {r[6], r[7], r[8]};
}

bool SameIntrinsics(const Pinhole& a, const Pinhole& b) {
  return a.width == b.width && a.height == b.height && std::abs(a.fx - b.fx) < kSameFocal * a.fx &&
         std::abs(a.fy - b.fy) < kSameFocal * a.fy;
}

// The neighbours of camera i, nearest first.
std::vector<size_t> Neighbours(const std::vector<Camera>& cameras, size_t i, size_t most) {
  const Vec3 center = cameras[i].Center(), forward = Forward(cameras[i]);
  std::vector<std::pair<double, size_t>> found;
  for (size_t k = 0; k < cameras.size(); ++k) {
    if (k == i || !SameIntrinsics(cameras[i].intrinsics, cameras[k].intrinsics)) continue;
    const Vec3 other = Forward(cameras[k]), at = cameras[k].Center();
    if (forward[0] * other[0] + forward[1] * other[1] + forward[2] * other[2] < kSameWay) continue;
    found.emplace_back(std::hypot(at[0] - center[0], at[1] - center[1], at[2] - center[2]), k);
  }
  std::sort(found.begin(), found.end());
  std::vector<size_t> neighbours;
  for (size_t k = 0; k < std::min(most, found.size()); ++k) neighbours.push_back(found[k].second);
  return neighbours;
}

// Half-way from a to b.
Camera Between(const Camera& a, const Camera& b) {
  auto p = QuaternionFromRotation(a.world_to_camera.rotation), q = QuaternionFromRotation(b.world_to_camera.rotation);
  double dot = 0;
  for (size_t k = 0; k < 4; ++k) dot += p[k] * q[k];
  for (size_t k = 0; k < 4; ++k) p[k] += dot < 0 ? -q[k] : q[k];
  Camera camera = a;
  camera.image.clear();
  camera.name = a.name + "+" + b.name;
  auto& pose = camera.world_to_camera;
  pose.rotation = RotationFromQuaternion<double>(p[0], p[1], p[2], p[3]);
  const Vec3 from = a.Center(), to = b.Center();
  for (size_t r = 0; r < 3; ++r) {
    pose.translation[r] = 0;
    for (size_t k = 0; k < 3; ++k) pose.translation[r] -= pose.rotation[3 * r + k] * 0.5 * (from[k] + to[k]);
  }
  return camera;
}

// Turns a point on the unit sphere by a rotation drawn from the seed.
std::array<double, 9> RandomRotation(uint64_t seed) {
  Random random = RandomStream(seed, RandomPurpose::kPoses);
  double q[4];
  for (double& x : q) x = random.Normal();
  return RotationFromQuaternion<double>(q[0], q[1], q[2], q[3]);
}

}  // namespace

Result<std::vector<Camera>> PosesAround(const GaussianCloud& cloud, double pixel_size, int64_t count, uint64_t seed) {
  if (count < 1) return Error{ErrorCode::kBadArgument, "there must be at least one pose"};
  if (!(pixel_size > 0) || !std::isfinite(pixel_size)) {
    return Error{ErrorCode::kBadArgument, Cat("pixel size ", pixel_size, " is not a positive length")};
  }
  const Framing framing = FrameCloud(cloud);
  const double distance = FramingDistance(framing, PinholeFromFov(100, 100, kPoseFieldOfView));
  const double side = 2 * std::tan(kPoseFieldOfView / 2) * distance / pixel_size;
  if (side > kMaxImageSide) {
    return Error{ErrorCode::kBadArgument, Cat("with pixels of ", pixel_size, " a picture of this splat would have ",
                                              side, " of them per side: is that the size of a training pixel?")};
  }
  Pinhole intrinsics = PinholeFromFov(100, 100, kPoseFieldOfView);
  intrinsics.width = intrinsics.height = std::max(kSmallestSide, static_cast<int>(std::lround(side)));
  intrinsics.fx = intrinsics.fy = distance / pixel_size;
  intrinsics.cx = intrinsics.cy = 0.5 * intrinsics.width;

  const auto turn = RandomRotation(seed);
  std::vector<Camera> poses;
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  for (int64_t i = 0; i < count; ++i) {
    const double y = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(count);
    const double ring = std::sqrt(std::max(0.0, 1 - y * y)), angle = golden * static_cast<double>(i);
    const Vec3 even = {ring * std::cos(angle), y, ring * std::sin(angle)};
    Vec3 center;
    for (size_t r = 0; r < 3; ++r) {
      center[r] = framing.target[r] +
                  distance * (turn[3 * r] * even[0] + turn[3 * r + 1] * even[1] + turn[3 * r + 2] * even[2]);
    }
    if (IsObstructed(cloud, center, kRoom * distance)) continue;
    Camera camera;
    camera.name = Cat("pose ", i);
    camera.intrinsics = intrinsics;
    ANCHORSPLAT_ASSIGN_OR_RETURN(camera.world_to_camera, LookAt(center, framing.target, {0, 1, 0}));
    poses.push_back(std::move(camera));
  }
  if (2 * static_cast<int64_t>(poses.size()) < count) {
    return Error{ErrorCode::kBadArgument,
                 Cat(count - static_cast<int64_t>(poses.size()), " of ", count,
                     " places around the splat are inside "
                     "of it: a scene can only be refined from where it was seen; give --cameras")};
  }
  return poses;
}

std::vector<Camera> PosesAlong(const std::vector<Camera>& cameras, int between) {
  std::vector<Camera> poses = cameras;
  for (size_t i = 0; i < cameras.size() && between > 0; ++i) {
    for (const size_t k : Neighbours(cameras, i, static_cast<size_t>(between))) {
      poses.push_back(Between(cameras[i], cameras[k]));
    }
  }
  return poses;
}

}  // namespace anchorsplat
