#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/rotation.h"
#include "core/spherical_harmonics.h"
#include "render/rasterizer.h"

// The rasterizer in double precision without tile lists or blocks, one pixel at a time: close to the paper (Kerbl et
// al. 2023) and gsplat's description of its kernels, and deliberately slow. The reference that render/ is tested
// against.
namespace anchorsplat::reference {

using Matrix3 = std::array<double, 9>;  // row-major

inline Matrix3 Multiply(const Matrix3& a, const Matrix3& b) {
  Matrix3 c{};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      for (size_t k = 0; k < 3; ++k) c[3 * i + j] += a[3 * i + k] * b[3 * k + j];
    }
  }
  return c;
}
inline Matrix3 Transpose(const Matrix3& a) { return {a[0], a[3], a[6], a[1], a[4], a[7], a[2], a[5], a[8]}; }

struct Splat {
  int64_t row;
  float depth;                // all 3DGS rasterizers sort by a float
  double x, y, z;             // mean in pixels; camera z
  double xx, xy, yy;          // 2-D covariance, dilated, px²
  double a, b, c;             // conic
  double opacity;             // after compensation, in modes that have it
  double radius_x, radius_y;  // px
  int tile_x0, tile_y0, tile_x1, tile_y1;
  std::array<double, 3> rgb;
};

// Projects row i to `out`; false if it is culled.
inline bool Project(const GaussianCloud& cloud, int64_t i, const Camera& camera, const RenderOptions& options,
                    Splat& out) {
  if (!IsUsable(cloud, i)) return false;
  const size_t row = static_cast<size_t>(i);
  const std::array<double, 3> mean = {cloud.means[3 * row], cloud.means[3 * row + 1], cloud.means[3 * row + 2]};
  const auto p = camera.ToCamera(mean);
  const double z = p[2];
  if (z < options.near_plane || z > options.far_plane) return false;

  const Matrix3 rotation = RotationFromQuaternion<double>(cloud.quats[4 * row], cloud.quats[4 * row + 1],
                                                          cloud.quats[4 * row + 2], cloud.quats[4 * row + 3]);
  Matrix3 scale{};
  for (size_t k = 0; k < 3; ++k) scale[4 * k] = std::exp(double{cloud.log_scales[3 * row + k]});
  const Matrix3 m = Multiply(Multiply(camera.world_to_camera.rotation, rotation), scale);
  const Matrix3 covariance = Multiply(m, Transpose(m));

  const Pinhole& k = camera.intrinsics;
  const double tan_x = 0.5 * k.width / k.fx, tan_y = 0.5 * k.height / k.fy;
  const double tx = z * std::clamp(p[0] / z, -(k.cx / k.fx + 0.3f * tan_x), (k.width - k.cx) / k.fx + 0.3f * tan_x);
  const double ty = z * std::clamp(p[1] / z, -(k.cy / k.fy + 0.3f * tan_y), (k.height - k.cy) / k.fy + 0.3f * tan_y);
  const Matrix3 jacobian = {k.fx / z, 0, -k.fx * tx / (z * z), 0, k.fy / z, -k.fy * ty / (z * z), 0, 0, 0};
  const Matrix3 image = Multiply(Multiply(jacobian, covariance), Transpose(jacobian));
  const double from = options.compensated_from;
  const double kept = (image[0] + from) * (image[4] + from) - image[1] * image[1];
  out.xx = image[0] + DilationOf(options);
  out.xy = image[1];
  out.yy = image[4] + DilationOf(options);
  const double det = out.xx * out.yy - out.xy * out.xy;
  if (!(det > 0) || !std::isfinite(det)) return false;
  out.a = out.yy / det;
  out.b = -out.xy / det;
  out.c = out.xx / det;
  out.opacity = 1 / (1 + std::exp(-double{cloud.opacity_logits[row]}));
  if (IsCompensated(options.mode)) out.opacity *= std::sqrt(std::max(0.0, kept / det));

  if (options.profile == RasterProfile::kGsplat14) {
    const double half_trace = 0.5 * (out.xx + out.yy);
    out.radius_x = out.radius_y =
        std::ceil(3 * std::sqrt(half_trace + std::sqrt(std::max(0.01, half_trace * half_trace - det))));
  } else {
    if (out.opacity < options.min_alpha) return false;
    const double extent = std::min(3.33, std::sqrt(2 * std::log(out.opacity / options.min_alpha)));
    out.radius_x = std::ceil(extent * std::sqrt(out.xx));
    out.radius_y = std::ceil(extent * std::sqrt(out.yy));
  }
  out.x = k.fx * p[0] / z + k.cx;
  out.y = k.fy * p[1] / z + k.cy;
  if (out.x + out.radius_x <= 0 || out.x - out.radius_x >= k.width || out.y + out.radius_y <= 0 ||
      out.y - out.radius_y >= k.height) {
    return false;
  }
  const auto tile = [](double t) { return static_cast<int>(std::clamp(t, -1.0, 1e6)); };
  out.tile_x0 = tile(std::floor((out.x - out.radius_x) / 16));
  out.tile_x1 = tile(std::ceil((out.x + out.radius_x) / 16));
  out.tile_y0 = tile(std::floor((out.y - out.radius_y) / 16));
  out.tile_y1 = tile(std::ceil((out.y + out.radius_y) / 16));

  const auto center = camera.Center();
  const double dx = mean[0] - center[0], dy = mean[1] - center[1], dz = mean[2] - center[2];
  const double norm = std::sqrt(dx * dx + dy * dy + dz * dz);
  const auto basis = ShBasis<double>(dx / norm, dy / norm, dz / norm);
  const size_t used = static_cast<size_t>(ShCoefficients(std::min(options.sh_degree, cloud.sh_degree)));
  for (size_t channel = 0; channel < 3; ++channel) {
    double sum = 0.5;
    for (size_t j = 0; j < used; ++j) {
      sum += basis[j] * cloud.sh[row * static_cast<size_t>(cloud.sh_stride()) + 3 * j + channel];
    }
    out.rgb[channel] = std::max(sum, 0.0);
  }
  out.row = i;
  out.z = z;
  out.depth = static_cast<float>(z);
  return true;
}

// All visible Gaussians, nearest first, ties by row.
inline std::vector<Splat> ProjectAll(const GaussianCloud& cloud, const Camera& camera, const RenderOptions& options) {
  std::vector<Splat> splats;
  Splat splat{};
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (Project(cloud, i, camera, options, splat)) splats.push_back(splat);
  }
  std::stable_sort(splats.begin(), splats.end(), [](const Splat& a, const Splat& b) { return a.depth < b.depth; });
  return splats;
}

struct Pixel {
  std::array<double, 3> rgb{};
  double alpha = 0;
  double depth = 0;
  int64_t last_row = -1;  // of the last Gaussian added
  // Smallest relative distance of an α to min_alpha or a T to min_transmittance: rounding decides pixels at a cut-off,
  // so comparisons must exclude them.
  double margin = std::numeric_limits<double>::infinity();
};

inline Pixel Blend(const std::vector<Splat>& splats, int px, int py, const RenderOptions& options) {
  Pixel pixel;
  double transmittance = 1;
  const int tile_x = px / 16, tile_y = py / 16;
  for (const Splat& g : splats) {
    if (tile_x < g.tile_x0 || tile_x >= g.tile_x1 || tile_y < g.tile_y0 || tile_y >= g.tile_y1) continue;
    const double dx = g.x - (px + 0.5), dy = g.y - (py + 0.5);
    const double sigma = 0.5 * (g.a * dx * dx + g.c * dy * dy) + g.b * dx * dy;
    if (sigma < 0) continue;  // rounding of a degenerate conic
    const double alpha = std::min<double>(kMaxAlpha, g.opacity * std::exp(-sigma));
    pixel.margin = std::min(pixel.margin, std::abs(alpha / options.min_alpha - 1));
    if (alpha < options.min_alpha) continue;
    const double next = transmittance * (1 - alpha);
    pixel.margin = std::min(pixel.margin, std::abs(next / options.min_transmittance - 1));
    if (next <= options.min_transmittance) break;
    for (size_t c = 0; c < 3; ++c) pixel.rgb[c] += alpha * transmittance * g.rgb[c];
    pixel.depth += alpha * transmittance * g.z;
    transmittance = next;
    pixel.last_row = g.row;
  }
  for (size_t c = 0; c < 3; ++c) pixel.rgb[c] += transmittance * options.background[c];
  pixel.alpha = 1 - transmittance;
  if (pixel.alpha > 0) pixel.depth /= pixel.alpha;
  return pixel;
}

}  // namespace anchorsplat::reference
