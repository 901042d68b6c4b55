#include "fit/view_pose.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr int kPoseRowsPerTask = 16;
constexpr float kSolid = 0.1f;  // alpha from which depth is meaningful
// Regularisation relative to the mean squared gradient per pixel: motions with less evidence stay.
constexpr double kPoseRidge = 1e-3;
constexpr double kMostStep = 1;       // pixels a step
constexpr double kHuber = 4.0 / 255;  // larger differences count linearly
constexpr size_t kMotions = 6;

using Motion = std::array<double, kMotions>;

// Partial normal equations.
struct Normal {
  std::array<double, kMotions * kMotions> matrix{};
  Motion right{};
  double gradient = 0;  // Σ of squared gradients
  int64_t pixels = 0;
};

using Rotation = std::array<double, 9>;

Rotation Product(const Rotation& a, const Rotation& b) {
  Rotation c{};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      for (size_t k = 0; k < 3; ++k) c[3 * i + j] += a[3 * i + k] * b[3 * k + j];
    }
  }
  return c;
}

// Rodrigues' formula.
Rotation RotationBy(const std::array<double, 3>& w) {
  const double angle = std::hypot(w[0], w[1], w[2]);
  const Rotation k = {0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0};
  const Rotation kk = Product(k, k);
  const double a = angle > 1e-9 ? std::sin(angle) / angle : 1;
  const double b = angle > 1e-9 ? (1 - std::cos(angle)) / (angle * angle) : 0.5;
  Rotation r = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  for (size_t i = 0; i < 9; ++i) r[i] += a * k[i] + b * kk[i];
  return r;
}

// Rotation vector of a small rotation.
std::array<double, 3> VectorOf(const Rotation& r) {
  const std::array<double, 3> axis = {(r[7] - r[5]) / 2, (r[2] - r[6]) / 2, (r[3] - r[1]) / 2};  // sin(angle)·unit
  const double sine = std::hypot(axis[0], axis[1], axis[2]);
  const double angle = std::atan2(sine, (r[0] + r[4] + r[8] - 1) / 2);
  const double scale = sine > 1e-12 ? angle / sine : 1;
  return {axis[0] * scale, axis[1] * scale, axis[2] * scale};
}

// Solves `a` x = `b` by Cholesky for symmetric positive definite `a`; false otherwise.
bool Solve(std::array<double, kMotions * kMotions> a, Motion b, Motion& x) {
  constexpr size_t n = kMotions;
  for (size_t j = 0; j < n; ++j) {
    for (size_t k = 0; k < j; ++k) a[j * n + j] -= a[j * n + k] * a[j * n + k];
    if (!(a[j * n + j] > 0)) return false;
    a[j * n + j] = std::sqrt(a[j * n + j]);
    for (size_t i = j + 1; i < n; ++i) {
      for (size_t k = 0; k < j; ++k) a[i * n + j] -= a[i * n + k] * a[j * n + k];
      a[i * n + j] /= a[j * n + j];
    }
  }
  for (size_t i = 0; i < n; ++i) {
    for (size_t k = 0; k < i; ++k) b[i] -= a[i * n + k] * b[k];
    b[i] /= a[i * n + i];
  }
  for (size_t i = n; i-- > 0;) {
    for (size_t k = i + 1; k < n; ++k) b[i] -= a[k * n + i] * b[k];
    b[i] /= a[i * n + i];
  }
  x = b;
  return std::all_of(x.begin(), x.end(), [](double v) { return std::isfinite(v); });
}

// Mean depth of solid pixels; 0 without any.
double MeanDepth(const RenderOutput& output) {
  double sum = 0;
  int64_t count = 0;
  for (size_t i = 0; i < output.alpha.pixels.size(); ++i) {
    if (output.alpha.pixels[i] < kSolid) continue;
    sum += double{output.depth.pixels[i]};
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

// Accumulates rows [first, last). `unit`: each motion that moves the centre by a pixel.
void AddRows(const RenderOutput& output, const Image& picture, const Pinhole& k, const Motion& unit, int first,
             int last, Normal& normal) {
  const Image& shown = output.color;
  for (int v = std::max(1, first); v < std::min(last, shown.height - 1); ++v) {
    for (int u = 1; u + 1 < shown.width; ++u) {
      const int64_t at = int64_t{v} * shown.width + u;
      if (output.alpha.pixels[static_cast<size_t>(at)] < kSolid) continue;
      const double z = output.depth.pixels[static_cast<size_t>(at)];
      if (!(z > 0)) continue;
      const double x = (u + 0.5 - k.cx) / k.fx, y = (v + 0.5 - k.cy) / k.fy;
      // Flow of this pixel for a rotation about, and a translation along, each axis.
      const Motion across = {-k.fx * x * y, k.fx * (1 + x * x), -k.fx * y, k.fx / z, 0, -k.fx * x / z};
      const Motion down = {-k.fy * (1 + y * y), k.fy * x * y, k.fy * x, 0, k.fy / z, -k.fy * y / z};
      for (int c = 0; c < 3; ++c) {
        const float* s = shown.channel(c) + at;
        const float* p = picture.channel(c) + at;
        // Averaging both pictures' gradients makes the step second-order accurate (Benhimane and Malis 2004).
        const double gx = 0.25 * (double{s[1]} - double{s[-1]} + double{p[1]} - double{p[-1]});
        const double gy = 0.25 * (double{s[shown.width]} - double{s[-shown.width]} + double{p[shown.width]} -
                                  double{p[-shown.width]});
        const double off = double{s[0]} - double{p[0]};
        const double weight = std::abs(off) <= kHuber ? 1 : kHuber / std::abs(off);
        Motion row;  // derivative of the difference: what moves right shows what was to its left
        for (size_t i = 0; i < kMotions; ++i) row[i] = -(gx * across[i] + gy * down[i]) * unit[i];
        for (size_t i = 0; i < kMotions; ++i) {
          normal.right[i] -= weight * row[i] * off;
          for (size_t j = 0; j <= i; ++j) normal.matrix[kMotions * i + j] += weight * row[i] * row[j];
        }
        normal.gradient += weight * (gx * gx + gy * gy);
      }
      ++normal.pixels;
    }
  }
}

Normal NormalEquations(const RenderOutput& output, const Image& picture, const Pinhole& k, const Motion& unit) {
  const int tasks = (picture.height + kPoseRowsPerTask - 1) / kPoseRowsPerTask;
  std::vector<Normal> parts(static_cast<size_t>(tasks));
  ParallelFor(0, tasks, 1, [&](int64_t first, int64_t last) {
    for (int64_t task = first; task < last; ++task) {
      const int from = static_cast<int>(task) * kPoseRowsPerTask;
      AddRows(output, picture, k, unit, from, std::min(picture.height, from + kPoseRowsPerTask),
              parts[static_cast<size_t>(task)]);
    }
  });
  Normal all;
  for (const Normal& part : parts) {
    for (size_t i = 0; i < all.matrix.size(); ++i) all.matrix[i] += part.matrix[i];
    for (size_t i = 0; i < kMotions; ++i) all.right[i] += part.right[i];
    all.gradient += part.gradient;
    all.pixels += part.pixels;
  }
  return all;
}

}  // namespace

Camera Moved(const Camera& camera, const std::array<double, 6>& motion) {
  const Rotation turn = RotationBy({motion[0], motion[1], motion[2]});
  Camera moved = camera;
  Pose& pose = moved.world_to_camera;
  pose.rotation = Product(turn, camera.world_to_camera.rotation);
  for (size_t i = 0; i < 3; ++i) {
    pose.translation[i] = motion[3 + i];
    for (size_t k = 0; k < 3; ++k) pose.translation[i] += turn[3 * i + k] * camera.world_to_camera.translation[k];
  }
  return moved;
}

std::array<double, 6> MotionBetween(const Camera& origin, const Camera& camera) {
  const Rotation& a = origin.world_to_camera.rotation;
  const Rotation back = {a[0], a[3], a[6], a[1], a[4], a[7], a[2], a[5], a[8]};
  const Rotation turn = Product(camera.world_to_camera.rotation, back);
  const auto w = VectorOf(turn);
  Motion motion = {w[0], w[1], w[2], 0, 0, 0};
  for (size_t i = 0; i < 3; ++i) {
    motion[3 + i] = camera.world_to_camera.translation[i];
    for (size_t k = 0; k < 3; ++k) motion[3 + i] -= turn[3 * i + k] * origin.world_to_camera.translation[k];
  }
  return motion;
}

Result<Camera> PoseAligner::Align(const GaussianCloud& cloud, const RenderOptions& render, const Camera& origin,
                                  const Camera& camera, const Image& picture, bool exposure, int steps) {
  const Pinhole& k = camera.intrinsics;
  if (picture.width != k.width || picture.height != k.height || picture.channels != 3) {
    return Error{ErrorCode::kBadArgument, Cat("a picture of ", picture.width, " x ", picture.height, " x ",
                                              picture.channels, " for a camera of ", k.width, " x ", k.height)};
  }
  RenderOptions options = render;
  options.depth = true;
  options.gradient = false;
  Camera aligned = camera;
  for (int step = 0; step < steps; ++step) {
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer_.Render(cloud, aligned, options, output_));
    const double depth = MeanDepth(output_);
    if (!(depth > 0)) return aligned;
    compared_ = picture;
    if (exposure) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const ViewExposure found, EstimateExposure(output_.color, compared_));
      RemoveExposure(found, compared_);
    }
    // A pixel at the centre; about or along the viewing axis, a pixel at half a picture from it.
    const double half = 0.25 * (k.width + k.height);
    const Motion unit = {1 / k.fy, 1 / k.fx, 1 / half, depth / k.fx, depth / k.fy, depth / half};
    Normal normal = NormalEquations(output_, compared_, k, unit);
    if (normal.pixels == 0) return aligned;
    const double ridge = kPoseRidge * normal.gradient;
    for (size_t i = 0; i < kMotions; ++i) {
      normal.matrix[kMotions * i + i] += ridge;
      for (size_t j = i + 1; j < kMotions; ++j) normal.matrix[kMotions * i + j] = normal.matrix[kMotions * j + i];
    }
    Motion motion;
    if (!(ridge > 0) || !Solve(normal.matrix, normal.right, motion)) return aligned;
    for (size_t i = 0; i < kMotions; ++i) motion[i] = std::clamp(motion[i], -kMostStep, kMostStep) * unit[i];
    Motion total = MotionBetween(origin, Moved(aligned, motion));
    for (size_t i = 0; i < kMotions; ++i)
      total[i] = std::clamp(total[i], -kMostAligned * unit[i], kMostAligned * unit[i]);
    aligned = Moved(origin, total);
  }
  return aligned;
}

}  // namespace anchorsplat
