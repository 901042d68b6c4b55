#include "enhance/refine_poses.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <utility>

#include "core/activations.h"
#include "core/framing.h"
#include "core/image.h"
#include "core/parallel.h"
#include "core/rotation.h"
#include "core/statistics.h"
#include "core/text.h"
#include "fit/random_streams.h"
#include "fit/training_views.h"

namespace anchorsplat {

namespace {

constexpr double kPoseFieldOfView = std::numbers::pi / 4;
constexpr int kSmallestSide = 32;    // pixels; smaller ones are useless, and SSIM's window needs 11
constexpr float kHides = 0.1f;       // opacity of Gaussians that obstruct a camera
constexpr double kRoom = 0.05;       // clearance around a camera, relative to the distance of the object
constexpr double kSigmas = 3;        // clearance from a Gaussian, in standard deviations
constexpr double kSameWay = 0.7071;  // cosine of 45°
constexpr double kSameFocal = 1e-3;  // relative
constexpr int kCheckNeighbours = 3;
constexpr int64_t kCheckCandidates = 256;
constexpr int64_t kCamerasPerCheck = 6;
constexpr float kSamePose = 1e-6f;  // PoseDistance below which there is nothing between two cameras

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
      // Using the largest axis is a rough bound, but only for Gaussians nearly as large as the object.
      if (distance < reach && Sigmoid(cloud.opacity_logits[static_cast<size_t>(i)]) > kHides) obstructed = true;
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

// The pose half-way between a and b.
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

// Rotates a point on the unit sphere by a random rotation.
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
    return Error{ErrorCode::kBadArgument, Cat("pixel size ", pixel_size, " makes pictures of ", side,
                                              " pixels per side: check that it is the size of a training pixel")};
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
                     " views around the splat are inside it. Pass --cameras: a scene can only be refined from "
                     "where it was seen")};
  }
  return poses;
}

std::vector<Camera> PosesAlong(const std::vector<Camera>& cameras, int between) {
  std::vector<Camera> poses = cameras;
  std::set<std::pair<size_t, size_t>> there;  // neighbours are mostly mutual
  for (size_t i = 0; i < cameras.size() && between > 0; ++i) {
    for (const size_t k : Neighbours(cameras, i, static_cast<size_t>(between))) {
      if (there.insert(std::minmax(i, k)).second) poses.push_back(Between(cameras[i], cameras[k]));
    }
  }
  return poses;
}

double PoseDistance(const Camera& a, const Camera& b, double scale) {
  const Vec3 p = a.Center(), q = b.Center();
  const auto &r = a.world_to_camera.rotation, &s = b.world_to_camera.rotation;
  double square = 0;  // squared Frobenius distance of the rotations: 8 sin²(angle/2)
  for (size_t k = 0; k < 9; ++k) square += (r[k] - s[k]) * (r[k] - s[k]);
  const double angle = 2 * std::asin(std::min(1.0, std::sqrt(square / 8)));
  return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]) / scale + angle;
}

std::vector<Camera> SubsampleEvenly(const std::vector<Camera>& cameras, int64_t most) {
  const auto count = static_cast<int64_t>(cameras.size());
  std::vector<Camera> some;
  for (int64_t i = 0; i < std::min(most, count); ++i) {
    some.push_back(cameras[static_cast<size_t>(i * count / std::min(most, count))]);
  }
  return some;
}

namespace {

// Distance from a pose to the nearest of `others` other than itself.
float Clearance(const Camera& pose, const std::vector<Camera>& others, double scale) {
  double least = std::numeric_limits<double>::infinity();
  for (const Camera& other : others) {
    if (&other != &pose) least = std::min(least, PoseDistance(pose, other, scale));
  }
  return static_cast<float>(least);
}

// The half of `places` farthest from all of `cameras`, which may be the same.
std::vector<Camera> ClearOf(const std::vector<Camera>& cameras, const std::vector<Camera>& places, double scale) {
  std::vector<float> clearances;
  for (const Camera& place : places) clearances.push_back(Clearance(place, cameras, scale));
  std::vector<float> sorted = clearances;
  const float least = places.empty() ? 0 : std::max(Quantile(sorted, 0.5), kSamePose);
  std::vector<Camera> clear;
  for (size_t i = 0; i < places.size(); ++i) {
    if (clearances[i] >= least && std::isfinite(clearances[i])) clear.push_back(places[i]);
  }
  return clear;
}

}  // namespace

RefinePoses RefinePosesAlong(const std::vector<Camera>& cameras, int between, int64_t checks) {
  double reach = 0;
  for (const Camera& camera : cameras) {
    for (const double x : camera.Center()) reach = std::max(reach, std::abs(x));
  }
  const double scale = std::max(SceneScale(cameras), kSamePose * reach);  // for coincident cameras, rounding error
  // Several neighbours, as the nearest may be a twin in a stereo pair.
  std::vector<Camera> places = PosesAlong(cameras, std::max(between, kCheckNeighbours));
  places.erase(places.begin(), places.begin() + std::ssize(cameras));
  // With few cameras this would take all poses between them.
  const auto count = std::ssize(cameras);
  RefinePoses poses;
  poses.train = PosesAlong(cameras, between);
  poses.check = SubsampleEvenly(ClearOf(cameras, SubsampleEvenly(places, kCheckCandidates), scale),
                                std::clamp<int64_t>(count / 3, 1, checks));
  if (!poses.check.empty()) {
    for (const Camera& check : poses.check) {
      const double room = 0.5 * Clearance(check, cameras, scale);
      poses.train.erase(std::remove_if(poses.train.begin() + count, poses.train.end(),
                                       [&](const Camera& pose) { return PoseDistance(pose, check, scale) < room; }),
                        poses.train.end());
    }
    return poses;
  }
  // Cameras are too far apart for poses between them: holds out some of them, if there are enough.
  const std::vector<Camera> clear = ClearOf(cameras, cameras, scale);
  poses.check = SubsampleEvenly(clear, std::min(count / kCamerasPerCheck, checks));
  poses.apart = !poses.check.empty();
  if (!poses.apart) {
    poses.check = SubsampleEvenly(cameras, checks);
    return poses;
  }
  for (const Camera& check : poses.check) {
    std::erase_if(poses.train, [&](const Camera& pose) { return PoseDistance(pose, check, scale) < kSamePose; });
  }
  return poses;
}

Result<RefinePoses> RefinePosesAround(const GaussianCloud& cloud, double pixel_size, int64_t count, int64_t checks,
                                      uint64_t seed) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<Camera> all, PosesAround(cloud, pixel_size, count + checks, seed));
  RefinePoses poses;
  poses.check = SubsampleEvenly(all, checks);
  size_t next = 0;
  for (Camera& pose : all) {
    if (next < poses.check.size() && pose.name == poses.check[next].name) {
      ++next;
    } else {
      poses.train.push_back(std::move(pose));
    }
  }
  if (poses.train.empty()) return Error{ErrorCode::kBadArgument, "there must be at least one pose"};
  return poses;
}

}  // namespace anchorsplat
